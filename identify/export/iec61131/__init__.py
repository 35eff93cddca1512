"""A reader of structured text (IEC 61131-3, third edition) that computes what a text says.

It is written from the standard's grammar and shares nothing with what writes the text, so that what it computes is a judgement.
"""
