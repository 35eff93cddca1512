"""Texts of remarks and reasons as sentences."""

import re

_NAME = re.compile(r"\S*[\d@_]")
"""a first word that is the name of a joint or of a parameter, as `j3` or `b_m@j6`"""


def sentence(text: str) -> str:
    """With a capital, save where a name begins it, and a full stop; nothing of an empty text."""
    begun = text if _NAME.match(text) else f"{text[:1].upper()}{text[1:]}"
    return f"{begun}{'' if text.endswith('.') or not text else '.'}"
