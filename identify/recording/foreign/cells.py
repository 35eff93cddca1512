"""Cells of text as numbers: decimal point or comma, thousands, told by the cells of a column."""

from __future__ import annotations

import re
from collections.abc import Iterable, Sequence
from functools import lru_cache
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from identify.recording.foreign.instants import is_instant
from identify.recording.units import unit_of

Decimal = Literal[".", ","]

_EXPONENT = r"(?:[eEdD][+-]?\d+)?"
_SIGN = r"[+\-−]?\s?"
_POINT = re.compile(rf"^{_SIGN}(?:\d+\.?\d*|\.\d+){_EXPONENT}$")
_COMMA = re.compile(rf"^{_SIGN}(?:\d+,\d*|,\d+){_EXPONENT}$")
_GROUPED_COMMA = re.compile(rf"^{_SIGN}\d{{1,3}}(?:,\d{{3}})+(?:\.\d+)?$")
_GROUPED_POINT = re.compile(rf"^{_SIGN}\d{{1,3}}(?:\.\d{{3}})+(?:,\d+)?$")
_GROUPED_OTHER = re.compile(rf"^{_SIGN}\d{{1,3}}(?:[ '’\u00a0\u202f\u2009]\d{{3}})+(?:[.,]\d+)?$")
_WITH_UNIT = re.compile(r"^([+\-−]?[\d.,]+(?:[eE][+-]?\d+)?)\s*([^\d\s.,;+\-][^\d\s;]{0,7})$")
EMPTY = frozenset(
    (
        "",
        "-",
        "--",
        "nan",
        "null",
        "none",
        "na",
        "n/a",
        "#n/a",
        "#nv",
        "nil",
        "?",
        "nan(ind)",
        "-nan",
        "-nan(ind)",
        "∞",
        "+∞",
        "-∞",
    )
)
"""What stands for no value, in small letters; ∞ is how oscilloscopes write a value beyond their range."""
_NOT_FINITE = re.compile(r"^[+-]?\d\.?#(?:inf|ind|qnan|snan|j)\d*$")
"""How Microsoft's C run-time library writes what is no finite number, in small letters: 1.#INF, -1.#IND00."""
TRUTHS = {"true": "1", "false": "0", "wahr": "1", "falsch": "0"}
WHOLE_IN_FLOAT = float(2**53)


def is_empty(cell: str) -> bool:
    """Whether a cell says that there is no value."""
    text = cell.strip().casefold()
    return text in EMPTY or ("#" in text and bool(_NOT_FINITE.match(text)))


def is_number(cell: str) -> bool:
    """Whether a cell is written as a number, with a decimal point or a decimal comma."""
    text = cell.strip()
    return bool(
        _POINT.match(text)
        or _COMMA.match(text)
        or _GROUPED_COMMA.match(text)
        or _GROUPED_POINT.match(text)
        or text.casefold() in ("inf", "-inf", "+inf", "infinity", "-infinity")
    )


def is_typed(cell: str) -> bool:
    """Whether a cell is what samples are made of: a number, a time, a truth value, a number with its unit, or none."""
    text = cell.strip()
    if is_empty(text) or is_number(text) or text.casefold() in TRUTHS:
        return True
    return is_instant(text) or with_unit(text) is not None or bool(_GROUPED_OTHER.match(text))


def with_unit(cell: str) -> tuple[str, str] | None:
    """The number of a cell and the unit behind it; None where no unit that is known follows, as in 1.5abc."""
    match = _WITH_UNIT.match(cell.strip())
    return (match[1], match[2]) if match and _is_unit(match[2]) else None


@lru_cache(maxsize=256)
def _is_unit(text: str) -> bool:
    return unit_of(text) is not None


def decimal_of(cells: Iterable[str]) -> tuple[Decimal | None, bool]:
    """The decimal sign of a column's cells and whether that is sure; None where no cell has a point or comma.

    A cell with both signs has the decimal one last. A sign that stands twice in a cell, or ahead of groups of three
    digits in all cells while another column's decimals are known, may separate thousands: then it is not sure.
    """
    points = commas = grouped_points = grouped_commas = 0
    for cell in cells:
        text = cell.strip()
        point, comma = text.rfind("."), text.rfind(",")
        if point >= 0 and comma >= 0:
            return (".", True) if point > comma else (",", True)
        if text.count(".") > 1 and _GROUPED_POINT.match(text):
            return ",", True
        if text.count(",") > 1 and _GROUPED_COMMA.match(text):
            return ".", True
        if point >= 0:
            points += 1
            grouped_points += bool(_GROUPED_POINT.match(text)) and not text.lstrip("+-−").startswith("0")
        elif comma >= 0:
            commas += 1
            grouped_commas += bool(_GROUPED_COMMA.match(text)) and not text.lstrip("+-−").startswith("0")
    if not points and not commas:
        return None, False
    if points >= commas:
        return ".", grouped_points < points
    return ",", grouped_commas < commas


def unit_in_cells(cells: Sequence[str]) -> str | None:
    """The text that follows the number in every cell that is not empty, if it is one and the same; else None."""
    filled = [with_unit(cell) for cell in cells if not is_empty(cell)]
    ends = {match[1] for match in filled if match is not None}
    return ends.pop() if None not in filled and len(ends) == 1 else None


def numbers(
    cells: Sequence[str], decimal: Decimal
) -> tuple[NDArray[np.float64] | NDArray[np.int64], list[int]]:
    """(N,) numbers of cells, NaN where a cell holds none, and the indices of cells that are neither number nor empty.

    Whole numbers beyond 2^53, as of clocks that count nanoseconds, stay whole: int64.
    """
    plain = not any("_" in cell or (decimal == "," and "." in cell) for cell in cells)
    try:
        if plain:
            written = [cell.replace(",", ".") for cell in cells] if decimal == "," else cells
            return _whole(cells, np.array(written, dtype=np.float64)), []
    except ValueError:
        pass
    wrong = []
    values = np.full(len(cells), np.nan)
    for index, cell in enumerate(cells):
        value = number(cell, decimal)
        if value is not None:
            values[index] = value
        elif not is_empty(cell):
            wrong.append(index)
    return values, wrong


def _whole(cells: Sequence[str], values: NDArray[np.float64]) -> NDArray[np.float64] | NDArray[np.int64]:
    if values.size and np.nanmax(np.abs(values), initial=0.0) >= WHOLE_IN_FLOAT:
        try:
            return np.array([int(cell) for cell in cells], dtype=np.int64)
        except (ValueError, OverflowError):
            return values
    return values


def number(cell: str, decimal: Decimal) -> float | None:
    """One cell as a number, or None."""
    text = cell.strip().replace("−", "-")
    plain = _POINT if decimal == "." else _COMMA
    if not (plain.match(text) or _POINT.match(text)):
        text = TRUTHS.get(text.casefold(), text)
        text = re.sub(r"[ '’\u00a0\u202f\u2009](?=\d{3})", "", text)
        grouped = _GROUPED_COMMA if decimal == "." else _GROUPED_POINT
        if grouped.match(text):
            text = text.replace("," if decimal == "." else ".", "")
        ended = with_unit(text)
        if ended is not None:
            text = ended[0]
    elif decimal == "," and _GROUPED_POINT.match(text) and "," not in text:
        text = text.replace(".", "")
    if decimal == ",":
        text = text.replace(",", ".")
    try:
        return None if "_" in text else float(text.replace(" ", "").replace("D", "E").replace("d", "e"))
    except ValueError:
        return None
