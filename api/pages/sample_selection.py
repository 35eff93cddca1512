"""A choice of samples, as one predicate: a session, and ranges of columns. It stands in the address, so that it can be sent.

velocity:-0.1:0.1;load:150:240        a cell of a map, or a rectangle in a plot of two columns
error:2:4                             a band of a histogram
time:10:12;session:session-01.csv     a stretch of time
"""

import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import Annotated
from urllib.parse import unquote

import numpy as np
from fastapi import Query
from numpy.typing import NDArray

from api.pages.number_format import listing, number
from api.pages.sample_columns import LONGEST_NAME, Column
from api.service.problems import Problem

SESSION = "session"
MOST_RANGES = 6
ChosenSamples = Annotated[str, Query(max_length=2000)]


@dataclass(frozen=True)
class ColumnRange:
    """Both ends are inside; in the column's own unit."""

    column: str
    low: float
    high: float


@dataclass(frozen=True)
class SampleSelection:
    """Samples of one session (None: of any) whose columns lie in all the ranges."""

    session: str | None
    ranges: tuple[ColumnRange, ...]

    @classmethod
    def parse(cls, text: str) -> "SampleSelection | None":
        """From an address; None where nothing is chosen. Raises the problem 422 for what is not such a choice."""
        session, ranges = None, []
        for part in filter(None, text.split(";")):
            name, *ends = part.split(":")
            if name == SESSION and len(ends) == 1:
                session = unquote(ends[0])
                continue
            numbers = [_number(end) for end in ends]
            low, high = numbers if len(numbers) == 2 else (None, None)
            if low is None or high is None or low > high or len(name) > 3 * LONGEST_NAME:
                raise Problem(
                    422, f"chosen: `{part}` is neither COLUMN:FROM:TO with FROM up to TO nor {SESSION}:FILE."
                )
            ranges.append(ColumnRange(unquote(name), low, high))
        if len(ranges) > MOST_RANGES:
            raise Problem(422, f"chosen: {len(ranges)} ranges, {MOST_RANGES} at most.")
        return cls(session, tuple(ranges)) if session or ranges else None

    def among(self, values: Callable[[str], NDArray], count: int) -> NDArray[np.bool_]:
        """(count,) which samples are chosen, of one session or of any; `values` gives a column (count,) by its name."""
        chosen = np.ones(count, bool)
        for each in self.ranges:
            column = values(each.column)
            chosen &= (column >= each.low) & (column <= each.high)
        return chosen

    def words(self, column: Callable[[str], Column]) -> str:
        """What is chosen, for a sentence: `speed −0.1 to 0.1 rad/s and load 150 to 240 N m, in session-01.csv`."""
        parts = []
        for each in self.ranges:
            of = column(each.column)
            unit = f" {of.unit}" if of.unit else ""
            # As many digits as tell the ends apart: 1234.5 s to 1236.0 s is no range from 1230 to 1240.
            width = each.high - each.low or abs(each.high) or 1.0
            digits = max(0, 2 - math.floor(math.log10(width)))
            parts.append(f"{of.label} {number(each.low, digits)} to {number(each.high, digits)}{unit}")
        ranges = listing(parts)
        if self.session is None:
            return ranges
        return f"{ranges}, in {self.session}" if ranges else self.session


def _number(text: str) -> float | None:
    try:
        value = float(text)
    except ValueError:
        return None
    return value if math.isfinite(value) else None
