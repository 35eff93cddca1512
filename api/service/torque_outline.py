"""The least and greatest values of a stored torque in blocks of samples, so that a plot of a long session reads little.

A session of a million samples is 64 MB on disk; its outline is a sixty-fourth of that, and all that a plot needs until its
blocks are as short as those of the outline. Then the samples themselves are few.
"""

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from api.service.envelope import envelope
from api.service.stored_samples import StoredSamples

Array = NDArray[np.float64]

BLOCK = 64
"""Samples of one block. A plot of 1200 columns reads 77 000 samples at most before the outline takes their place."""
CURVES = ("measured", "predicted", "error")
ROWS = (
    "begin",
    "middle",
    *(f"{end} {name}" for name in CURVES for end in ("least", "greatest")),
    "square measured",
    "square error",
    "moving",
)
"""Rows of an outline, (11, blocks): s, of the first and the middle sample; N m or N; sums of squares and number of the
samples in which the joint moves. The error is NaN where a joint rests in all of a block."""


def outline(part: StoredSamples) -> Array:
    """The outline (11, blocks) of stored samples; the last block may be shorter."""
    count = part.count
    starts = np.arange(0, count, BLOCK)
    if not count:
        return np.zeros((len(ROWS), 0))
    time = np.asarray(part.time)
    measured, error = np.asarray(part.measured), part.error()
    moving = ~np.isnan(error)
    curves = {"measured": measured, "predicted": np.asarray(part.predicted), "error": error}
    rows = [time[starts], time[np.minimum(starts + BLOCK // 2, count - 1)]]
    for values in curves.values():
        rows += [np.fmin.reduceat(values, starts), np.fmax.reduceat(values, starts)]
    for values in (
        np.where(moving, measured, 0.0) ** 2,
        np.where(moving, error, 0.0) ** 2,
        moving.astype(float),
    ):
        rows.append(np.add.reduceat(values, starts))
    return np.stack(rows)


@dataclass(frozen=True)
class Reduced:
    """What draws the same line as some rows of a session.

    time   : (points,) s
    curves : name -> (points,); pairs of least and greatest value where `starts` is given
    starts : (points / 2,) first row of each block; None where the points are the samples themselves
    """

    time: Array
    curves: dict[str, Array]
    starts: NDArray[np.intp] | None

    def marked(self, chosen: NDArray[np.bool_], rows: slice) -> Array:
        """(points,) 1 where a sample is chosen, or any of a block, else NaN; `chosen` is of `rows`, as they were reduced."""
        if self.starts is not None and len(self.starts):
            chosen = np.repeat(np.logical_or.reduceat(chosen, self.starts - rows.start), 2)
        return np.where(chosen, 1.0, np.nan)


def reduced(part: StoredSamples, of_part: Array, rows: slice, points: int) -> tuple[Reduced, slice]:
    """Reduce some rows of a session to at most `points` points, and say which rows those are: whole blocks of the outline,
    where it is used."""
    count = rows.stop - rows.start
    length = -(-count // max(1, points // 2 - 3))  # two blocks more may be reached into at the ends
    if count <= points or length < 2 * BLOCK:
        seen = {"measured": np.asarray(part.measured[rows]), "predicted": np.asarray(part.predicted[rows])}
        seen["error"] = part.error(rows)
        time = np.asarray(part.time[rows])
        origin, values = envelope(time, seen, points)
        starts = None
        if count > points:
            step = -(-count // max(1, points // 2))
            starts = rows.start + np.arange(0, count, step)
        # the envelope's time is float32 after its origin: enough to draw
        drawn = Reduced(origin + values[0].astype(float), dict(zip(CURVES, values[1:], strict=True)), starts)
        return drawn, rows
    together = -(-length // BLOCK)
    first, last = rows.start // BLOCK, -(-rows.stop // BLOCK)
    begins = np.arange(first, last, together)
    middles = np.minimum(begins + together // 2, last - 1)
    time = np.empty(2 * len(begins))
    time[0::2] = of_part[0, begins]
    time[1::2] = of_part[1, middles]
    curves = {}
    for place, name in enumerate(CURVES):
        least, greatest = of_part[2 + 2 * place, first:last], of_part[3 + 2 * place, first:last]
        curve = np.empty(2 * len(begins))
        curve[0::2] = np.fmin.reduceat(least, begins - first)
        curve[1::2] = np.fmax.reduceat(greatest, begins - first)
        curves[name] = curve
    whole = slice(first * BLOCK, min(last * BLOCK, part.count))
    return Reduced(time, curves, begins * BLOCK), whole


@dataclass(frozen=True)
class Sums:
    """Of samples in which a joint moves: how many, and the sums of squares of torque and error."""

    samples: float = 0.0
    measured: float = 0.0
    error: float = 0.0

    def __add__(self, other: "Sums") -> "Sums":
        return Sums(self.samples + other.samples, self.measured + other.measured, self.error + other.error)

    @property
    def relative_error(self) -> float | None:
        """‖ρ‖ / ‖Y‖, or None where there is nothing to divide by."""
        return math.sqrt(self.error / self.measured) if self.measured > 0 else None

    def rms(self, squares: float) -> float | None:
        """Root mean square of what the sum of squares is of; None where there are no samples."""
        return math.sqrt(squares / self.samples) if self.samples else None


def sums(part: StoredSamples, of_part: Array, rows: slice) -> Sums:
    """Of the samples in some rows, exactly: whole blocks from the outline, what is over at either end from the samples."""
    first, last = -(-rows.start // BLOCK), rows.stop // BLOCK
    if last <= first:
        return _sums_of(part, rows)
    inside = of_part[-3:, first:last].sum(axis=1)
    return (
        Sums(samples=float(inside[2]), measured=float(inside[0]), error=float(inside[1]))
        + _sums_of(part, slice(rows.start, first * BLOCK))
        + _sums_of(part, slice(last * BLOCK, rows.stop))
    )


def _sums_of(part: StoredSamples, rows: slice) -> Sums:
    error = part.error(rows)
    moving = ~np.isnan(error)
    measured = np.asarray(part.measured[rows])[moving]
    return Sums(float(moving.sum()), float(measured @ measured), float(error[moving] @ error[moving]))
