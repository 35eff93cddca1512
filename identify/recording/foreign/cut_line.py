"""Whether the last line of a table was cut inside its last cell: a recorder that is stopped or a full disk ends a file anywhere.

Only a line that is not ended can be cut. Part of a number is a number too, so that the cells above are what tells it.
"""

from __future__ import annotations

import re
from collections.abc import Sequence

import numpy as np

from identify.recording.foreign.cells import Decimal, is_empty, number

_EXPONENT = re.compile(r"[eEdD][+-]?(\d*)$")
LONGER_STEP = 2.0
"""Times the longest step between cells above: a number that lost digits is a power of ten off."""


def is_cut(cell: str, above: Sequence[str], decimal: Decimal) -> bool:
    """Whether a cell is the begin of one that was written like those above it.

    above : cells of the same column, in the file's order

    It is where it is empty or no number and they are not, where each of them has more decimals (or digits of the exponent, or
    letters), and where it is farther from the one before than these are from each other.
    """
    filled = [each for each in above if not is_empty(each)]
    if not filled:
        return False
    if is_empty(cell):
        return len(filled) == len(above)
    values = [number(each, decimal) for each in filled]
    known = np.array([value for value in values if value is not None and np.isfinite(value)])
    value = number(cell, decimal)
    if 2 * len(known) < len(filled):  # words or times
        return len(cell) < min(map(len, filled))
    if value is None:
        return None not in values
    if any(
        count(cell, decimal) < min(count(each, decimal) for each in filled)
        for count in (_decimals, _digits_of_exponent)
    ):
        return True
    steps = np.abs(np.diff(known))
    return len(steps) > 1 and bool(abs(value - known[-1]) > LONGER_STEP * steps.max())


def _decimals(cell: str, decimal: Decimal) -> int:
    mantissa = _EXPONENT.sub("", cell.strip())
    return len(mantissa.rpartition(decimal)[2]) if decimal in mantissa else 0


def _digits_of_exponent(cell: str, decimal: Decimal) -> int:
    match = _EXPONENT.search(cell.strip())
    return len(match[1]) if match else 0
