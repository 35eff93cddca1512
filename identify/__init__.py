"""Identification and diagnosis of robot joints: a numerical library, usable from a notebook."""
