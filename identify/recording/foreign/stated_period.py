"""The time between samples where a file states it above them and has no time column (LabVIEW, oscilloscopes, PLC traces)."""

from __future__ import annotations

import itertools
import re
from collections.abc import Iterator, Sequence
from dataclasses import dataclass

from identify.recording.units import unit_of

_PERIOD = (
    r"delta[\s_]?[xt]|dt|x?[\s_-]?incr(?:ement)?|t[\s_]?inc|sampl(?:e|ing)[\s_-]*(?:interval|period|time)"
    r"|abtast(?:zeit|intervall|periode)|time[\s_-]?step"
)
"""Names as LabVIEW (Delta_X), Rigol (Increment, tInc), Tektronix (Sample Interval) and control cabinets write them."""
_RATE = r"sampl(?:e|ing)[\s_-]*(?:rate|freq(?:uency)?)|abtast(?:rate|frequenz)"
_NAME = re.compile(
    rf"(?<![^\W_])(?:(?P<period>{_PERIOD})|(?P<rate>{_RATE}))(?![^\W_])"
    r"(?:\s*[\[(]\s*(?P<unit>[^\])]*?)\s*[\])])?",
    re.IGNORECASE,
)
_SIGN = re.compile(r"[ \"']*[=:;,|\t][\s\"'=]*")
"""Between a name and its number; a blank alone joins words."""
_VALUE = re.compile(
    r"(?P<number>[+-]?(?:\d+(?:[.,]\d+)?|\.\d+)(?:[eE][+-]?\d+)?)[\"']? ?(?P<unit>[a-zA-Zµμ/]*)"
)
_VALUE_BETWEEN_COMMAS = re.compile(_VALUE.pattern.replace("[.,]", "[.]"))
_HERTZ = {"": 1.0, "hz": 1.0, "khz": 1e3, "mhz": 1e6, "sps": 1.0, "s/s": 1.0, "sa/s": 1.0, "1/s": 1.0}
"""Unit of a rate in small letters -> Hz; of no file that states a motion is a rate in millihertz."""
_SAME = 1e-6
"""Relative difference of two statements of one period: they are written with as many digits."""


@dataclass(frozen=True)
class StatedPeriod:
    """The time between samples, and where it stands."""

    seconds: float
    said: str


def stated_period(head: Sequence[str], rows: Sequence[Sequence[str]], separator: str) -> StatedPeriod | None:
    """The period that lines above the samples state; None where none does, or where they contradict each other.

    head, rows : these lines, whole and as cells
    """
    if any(_is_no_time(line) for line in head):
        return None
    value = _VALUE_BETWEEN_COMMAS if separator == "," else _VALUE
    periods = [*_in_lines(head, value), *_in_cells_below(rows, value)]
    if not periods or any(abs(each.seconds / periods[0].seconds - 1) > _SAME for each in periods):
        return None
    return periods[0]


def _is_no_time(line: str) -> bool:
    """Whether a line says that what grows from sample to sample is something else, as LabVIEW's X_Dimension may."""
    return line.startswith("X_Dimension") and "time" not in line.casefold()


def _in_lines(head: Sequence[str], written: re.Pattern[str]) -> Iterator[StatedPeriod]:
    """NAME = NUMBER UNIT, with any sign between them; what follows on the line is of further channels."""
    for number, line in enumerate(head, start=1):
        for name in _NAME.finditer(line):
            place = name.end()
            while (sign := _SIGN.match(line, place)) and (value := written.match(line, sign.end())):
                seconds = _seconds(name, value["number"], name["unit"] or value["unit"])
                if seconds is not None:
                    yield StatedPeriod(seconds, _words(seconds, name[0], number))
                place = value.end()


def _in_cells_below(rows: Sequence[Sequence[str]], written: re.Pattern[str]) -> Iterator[StatedPeriod]:
    """A name of a column without samples, and the number in the cell below it."""
    for number, (row, below) in enumerate(itertools.pairwise(rows), start=1):
        for cell, under in zip(row, below, strict=False):
            name, value = _NAME.fullmatch(cell.strip()), written.fullmatch(under.strip())
            seconds = (
                _seconds(name, value["number"], name["unit"] or value["unit"]) if name and value else None
            )
            if seconds is not None:
                yield StatedPeriod(seconds, _words(seconds, cell, number + 1))


def _words(seconds: float, name: str, line: int) -> str:
    return f"{seconds:g} s between samples, by {name.strip()} in line {line}"


def _seconds(name: re.Match[str], number: str, unit: str | None) -> float | None:
    value = float(number.replace(",", "."))
    if name["rate"]:
        factor = _HERTZ.get((unit or "").casefold())
        return 1 / (value * factor) if factor and value > 0 else None
    known = unit_of(unit) if unit else unit_of("s")
    if known is None or known.quantity != "time":
        return None
    return value * known.factor if value > 0 else None
