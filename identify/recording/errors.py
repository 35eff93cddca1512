"""The error that a user's input can cause."""

import unicodedata

NOT_SHOWN = ("Cc", "Cf", "Cs", "Zl", "Zp")
"""Unicode categories: control characters, format characters, surrogates, separators of lines and paragraphs."""


class InputError(Exception):
    """What the user gave is wrong: one line that names the file, line or field and says what would be right.

    The command line turns it into exit status 2, the REST service into a problem document of status 422. Messages quote what
    stands in files of others: a character that is not shown, or would begin a line or command a terminal, is written as its code.
    """

    def __init__(self, message: str) -> None:
        super().__init__(one_line(message))


def one_line(text: str) -> str:
    """The text with every character that is not shown written as its code, and line ends as spaces."""
    return text if text.isprintable() else "".join(_shown(character) for character in text)


def _shown(character: str) -> str:
    if character == "\n":
        return " "
    if unicodedata.category(character) not in NOT_SHOWN:
        return character
    return character.encode("unicode_escape").decode()
