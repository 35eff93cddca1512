"""Two columns against each other, thinned to what a plot of a given size shows."""

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]


@dataclass(frozen=True)
class ThinnedPairs:
    """Samples that stand for all: one of every cell that holds any, and the extremes of each column and row of cells.

    rows  : (kept,) indices of the samples, increasing
    count : (kept,) samples in the cell of each
    """

    rows: NDArray[np.intp]
    count: NDArray[np.intp]


def thinned_pairs(x: Array, y: Array, across: int, up: int) -> ThinnedPairs:
    """Thin (samples,) pairs on a grid of `across` by `up` cells over their range; pairs that are not finite are left out.

    No outlier is lost: a sample alone in its cell stays, and the least and greatest of each column and each row stay exactly.
    """
    finite = np.flatnonzero(np.isfinite(x) & np.isfinite(y))
    if not len(finite):
        return ThinnedPairs(finite, finite)
    x, y = x[finite], y[finite]
    column, row = _cells(x, across), _cells(y, up)
    cell = row * across + column
    count = np.bincount(cell, minlength=across * up)
    kept = np.full(across * up, -1, dtype=np.intp)
    kept[cell[::-1]] = np.arange(len(cell))[::-1]  # the first of each cell is written last
    chosen = [kept[kept >= 0], *_extremes(y, column, across), *_extremes(x, row, up)]
    rows = np.unique(np.concatenate(chosen))
    return ThinnedPairs(finite[rows], count[cell[rows]])


def _cells(values: Array, cells: int) -> NDArray[np.intp]:
    low, high = float(values.min()), float(values.max())
    if high <= low:
        return np.zeros(len(values), np.intp)
    # The range of the largest numbers is none unless they are halved, and half of the smallest number is 0.
    scale = 1.0 if math.isfinite(high - low) else 0.5
    place = (scale * values - scale * low) / (scale * high - scale * low) * cells
    return np.minimum(place.astype(np.intp), cells - 1)


def _extremes(values: Array, group: NDArray[np.intp], groups: int) -> list[NDArray[np.intp]]:
    """For the least and the greatest value of each group one sample that has it."""
    rows = []
    for start, ufunc in ((np.inf, np.minimum), (-np.inf, np.maximum)):
        ends = np.full(groups, start)
        ufunc.at(ends, group, values)
        at_end = np.flatnonzero(values == ends[group])
        _, first = np.unique(group[at_end], return_index=True)
        rows.append(at_end[first])
    return rows
