"""Texts of remarks and reasons as sentences."""


def sentence(text: str) -> str:
    """With a capital and a full stop; nothing of an empty text."""
    return f"{text[:1].upper()}{text[1:]}{'' if text.endswith('.') or not text else '.'}"
