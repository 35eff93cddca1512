"""The min-max envelope of a signal: what a plot of any width shows of any number of samples."""

from collections.abc import Mapping

import numpy as np
from numpy.typing import NDArray


def visible_rows(time: NDArray[np.float64], start: float | None, end: float | None) -> slice:
    """Rows of a sorted time axis (N,) s that lie within [start, end], with one neighbour on each side, so
    that a line drawn through them reaches the edges of the plot."""
    first = 0 if start is None else max(0, int(np.searchsorted(time, start)) - 1)
    last = len(time) if end is None else min(len(time), int(np.searchsorted(time, end, side="right")) + 1)
    return slice(first, max(first, last))


def envelope(
    time: NDArray[np.float64], signals: Mapping[str, NDArray], points: int
) -> tuple[float, NDArray[np.float32]]:
    """Reduce signals to at most `points` rows that draw the same line.

    time    : (N,) s
    signals : name -> (N,); NaN marks a sample that did not come
    points  : rows at most, at least 2

    Returns the time origin in s (float64; float32 would lose milliseconds after some hours) and a float32
    array (1 + signals, rows): time less the origin, then each signal. Up to `points` samples are returned
    as they are; more are cut into equal blocks, and each block gives two rows, its smallest and its largest
    value.
    """
    count = len(time)
    origin = float(time[0]) if count else 0.0
    if count <= points:
        rows = [time - origin, *signals.values()]
        return origin, np.array(rows, dtype=np.float32).reshape(len(rows), count)
    blocks = max(1, points // 2)
    # Blocks of equal length are a reshape without a copy; the last, shorter one is reduced by itself.
    length = -(-count // blocks)
    whole = count // length
    reduced = np.empty((1 + len(signals), 2 * -(-count // length)), dtype=np.float32)
    starts = np.arange(reduced.shape[1] // 2) * length
    middles = np.minimum(starts + length // 2, count - 1)
    reduced[0, 0::2] = time[starts] - origin
    reduced[0, 1::2] = time[middles] - origin
    for row, values in enumerate(signals.values(), start=1):
        cut = values[: whole * length].reshape(whole, length)
        # fmin and fmax leave NaN out where a block has any number at all.
        reduced[row, 0 : 2 * whole : 2] = np.fmin.reduce(cut, axis=1)
        reduced[row, 1 : 2 * whole : 2] = np.fmax.reduce(cut, axis=1)
        if whole * length < count:
            rest = values[whole * length :]
            reduced[row, -2:] = np.fmin.reduce(rest), np.fmax.reduce(rest)
    return origin, reduced
