"""Rows above the samples: of units, of data types, and those that say by their first cell what they hold.

The last stand above samples that have no such cell, as of dSPACE ControlDesk:


type,x,y,y
unit,s,deg,A
name,time,position,current
trace_values,0,12.5,0.31
,0.001,12.6,0.3
"""

from __future__ import annotations

import re

from identify.recording.foreign.cells import is_empty
from identify.recording.units import unit_of

NAME_LABELS = frozenset(
    ("name", "names", "signal", "signals", "channel", "channels", "variable", "label", "labels")
)
UNIT_LABELS = frozenset(("unit", "units", "einheit", "einheiten"))
TYPE_NAME = re.compile(
    r"(?:u?[sdl]?int|float|double|single|l?real|bool|boolean|[dl]?word|byte|string|time|datetime)\d*",
    re.IGNORECASE,
)
"""Names of data types; a row of them says nothing that the numbers do not."""


def labelled_header(
    rows: list[list[str]], samples: list[list[str]], width: int
) -> tuple[int, list[str], list[str]] | None:
    """Place of the row of names, names, row of units (empty if there is none); None where rows are not labelled so.

    rows    : the rows above the samples, as cells
    samples : some rows of samples; the first may have a label too
    """
    if width < 3 or len(samples) < 2 or any(row[0] for row in samples[1:] if row):
        return None
    labels = [row[0].strip(":[] ").casefold() if len(row) > 1 else "" for row in rows]
    named = next(
        (place for place, label in enumerate(labels) if label in NAME_LABELS and len(rows[place]) >= width),
        None,
    )
    if named is None:
        return None
    unit = next((place for place, label in enumerate(labels) if label in UNIT_LABELS), None)
    names = ["", *rows[named][1:]]
    return named, names, [] if unit is None else ["", *rows[unit][1:]]


def trimmed(row: list[str]) -> list[str]:
    """A row without empty cells at its end, which separators at the end of each line make."""
    while row and not row[-1]:
        row = row[:-1]
    return row


def is_units(row: list[str]) -> bool:
    """Whether a row holds units: half of its cells at least, or all of them in brackets."""
    filled = [cell for cell in row if not is_empty(cell)]
    known = sum(unit_of(cell) is not None or cell.strip("[](){}<> ") in ("", "-", "1") for cell in filled)
    bracketed = sum(cell[:1] in "[({<" and cell[-1:] in "])}>" for cell in filled)
    return bool(filled) and (2 * known >= len(filled) or bracketed == len(filled))


def is_types(row: list[str]) -> bool:
    """Whether a row holds names of data types."""
    filled = [cell.strip("[](){}<>").casefold() for cell in row if cell]
    return bool(filled) and all(TYPE_NAME.fullmatch(cell) for cell in filled)
