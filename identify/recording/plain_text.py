"""Texts that people typed, where they are shown or opened by other programs."""

import unicodedata
from typing import Annotated

from pydantic import AfterValidator, Field

ZERO_WIDTH_JOINERS = "\u200c\u200d"
"""Format characters that words of several scripts are written with."""
LONGEST_NAME = 255
"""Characters of a name, wherever one is taken in: as long as a file system lets one be, and as the index stores it."""
LONGEST_QUOTE = 60
"""Characters."""
FORMULA_SIGNS = "=+-@\t\r"
"""With one of them in front, a spreadsheet takes a cell for a formula and computes it."""


def check_printable(text: str) -> str:
    """The same text. Raises ValueError where it holds a character that is not shown, or that changes how others are."""
    for character in text:
        if (
            unicodedata.category(character) in ("Cc", "Cf", "Cs", "Zl", "Zp")
            and character not in ZERO_WIDTH_JOINERS
        ):
            raise ValueError(f"holds the character U+{ord(character):04X}, which is not shown; leave it out")
    return text


Printable = Annotated[str, AfterValidator(check_printable)]
"""A text in which every character is shown."""
Name = Annotated[str, Field(min_length=1, max_length=LONGEST_NAME), AfterValidator(check_printable)]
"""What people call a robot, a joint, a payload."""


def printable(text: str) -> str:
    """The text with what `check_printable` refuses replaced by spaces."""
    return "".join(" " if not _shown(character) else character for character in text)


def quoted(text: str) -> str:
    """The text in quotes for a message: no more of it than tells which it is, and nothing that a terminal would obey."""
    shown = printable(text)
    return f"'{shown[:LONGEST_QUOTE]}...'" if len(shown) > LONGEST_QUOTE else f"'{shown}'"


def text_cell(text: str) -> str:
    """A text as a cell of CSV that no spreadsheet takes for a formula: with an apostrophe before a sign of one."""
    return f"'{text}" if text.startswith(tuple(FORMULA_SIGNS)) else text


def header_cell(name: str) -> str:
    """A column's name for a header without quotes: no formula, no separator, no line end, no quote."""
    return text_cell("".join("_" if each in ',;"' else each for each in printable(name)).strip())


def _shown(character: str) -> bool:
    try:
        check_printable(character)
    except ValueError:
        return False
    return True
