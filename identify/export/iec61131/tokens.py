"""The words of a structured text (IEC 61131-3, third edition, 6.1)."""

from __future__ import annotations

import re
from dataclasses import dataclass
from typing import Literal

from identify.recording.errors import InputError

Kind = Literal["integer", "real", "name", "sign", "end"]

KEYWORDS = frozenset(
    re.findall(
        r"\w+",
        """
    AND ARRAY BOOL BY CASE CONSTANT DINT DO ELSE ELSIF END_CASE END_FOR END_FUNCTION END_FUNCTION_BLOCK END_IF END_PROGRAM
    END_REPEAT END_VAR END_WHILE EXIT FALSE FOR FUNCTION FUNCTION_BLOCK IF INT LINT LREAL MOD NOT OF OR PROGRAM REAL REPEAT
    RETURN SINT STRING STRUCT THEN TO TRUE TYPE UDINT UINT ULINT UNTIL USINT VAR VAR_IN_OUT VAR_INPUT VAR_OUTPUT VAR_TEMP
    WHILE XOR
    """,
    )
)
"""what no variable, function or block can be called"""

_PATTERN = re.compile(
    r"""
    (?P<space>\s+|//[^\n]*)
    | (?P<comment>\(\*|/\*)
    | (?P<real>[0-9](?:_?[0-9])*\.[0-9](?:_?[0-9])*(?:[Ee][+-]?[0-9]+)?)
    | (?P<integer>(?:2|8|16)\#[0-9A-Fa-f](?:_?[0-9A-Fa-f])*|[0-9](?:_?[0-9])*)
    | (?P<name>[A-Za-z_][A-Za-z0-9_]*)
    | (?P<sign>:=|=>|\.\.|\*\*|<=|>=|<>|[-+*/()\[\],;:<>=&\#])
    """,
    re.VERBOSE,
)
_COMMENT = {"(*": re.compile(r"\(\*|\*\)"), "/*": re.compile(r"/\*|\*/")}


@dataclass(frozen=True)
class Token:
    """A word: its kind, its text (names in capitals, for case has no meaning) and its line."""

    kind: Kind
    text: str
    line: int


def tokens(text: str, source: str) -> list[Token]:
    """The words of a text; the last is of the kind "end".

    source : name of the file, for messages
    Raises InputError: with the line, where the text has what is no word of the language.
    """
    read: list[Token] = []
    place, line = 0, 1
    while place < len(text):
        match = _PATTERN.match(text, place)
        if match is None:
            raise InputError(f"{source} line {line}: {text[place : place + 10]!r} is not structured text")
        end = match.end()
        if match.lastgroup == "comment":
            end = _end_of_comment(text, match, source, line)
        elif match.lastgroup != "space":
            read.append(_token(match, source, line))
            if read[-1].kind in ("integer", "real") and text[end : end + 1].isalnum():
                raise InputError(f"{source} line {line}: '{match[0]}{text[end]}' is no number")
        line += text.count("\n", place, end)
        place = end
    return [*read, Token("end", "the end of the text", line)]


def _token(match: re.Match[str], source: str, line: int) -> Token:
    text = match[0]
    if match.lastgroup != "name":
        return Token(
            "integer" if match.lastgroup == "integer" else "real" if match.lastgroup == "real" else "sign",
            text,
            line,
        )
    if "__" in text or text.endswith("_"):
        raise InputError(
            f"{source} line {line}: '{text}': a name has no double underscore and no underscore at its end"
        )
    return Token("name", text.upper(), line)


def _end_of_comment(text: str, opened: re.Match[str], source: str, line: int) -> int:
    """Where a comment ends; comments nest."""
    marks, depth, place = _COMMENT[opened[0]], 1, opened.end()
    while depth:
        mark = marks.search(text, place)
        if mark is None:
            raise InputError(f"{source} line {line}: a comment that begins here does not end")
        depth += 1 if mark[0] == opened[0] else -1
        place = mark.end()
    return place
