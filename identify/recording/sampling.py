"""Uniform time: segments without a hole, and resampling where the recorded time is not uniform."""

from __future__ import annotations

import itertools
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from identify.recording.errors import InputError
from identify.recording.session_csv import RawSamples

if TYPE_CHECKING:
    from identify.recording.experiment import Session, SessionEntry

Array = NDArray[np.float64]

UNIFORM_WITHIN = 0.01
"""Of the period: a time within this of a uniform one is used as it is. It shifts a sample by 1 % of a
period, far less than the jitter of the sampling itself."""
LARGEST_BRIDGED_SAMPLES = 5
LARGEST_BRIDGED_TIME = 0.010
"""s; at most so many missing samples in a row, and at most so long, are bridged by local interpolation.
Both lie well below the memory of the position filter (several hundredths of a second); a longer hole splits
the record."""
SMALLEST_HOLE = 2.5
"""Periods: a step in time up to this is jitter or a single missing sample, whatever the sampling rate."""
SHORTEST_SEGMENT = 16
"""Samples; a shorter piece between two holes is left out."""


def largest_bridged_step(period: float) -> float:
    """The longest step in time, s, that is not a hole."""
    bridged = min(LARGEST_BRIDGED_SAMPLES * period, LARGEST_BRIDGED_TIME)
    return max(SMALLEST_HOLE * period, bridged + 1.5 * period)


def uniform_session(entry: SessionEntry, raw: RawSamples) -> Session:
    """Make a session of uniform time within each segment out of the samples of a file.

    :raises InputError: no piece of the record is long enough to be used.
    """
    from identify.recording.experiment import Session

    time = raw.time
    remarks = list(raw.remarks)
    if len(time) < SHORTEST_SEGMENT:
        raise InputError(f"{entry.path}: holds {len(time)} samples; at least {SHORTEST_SEGMENT} are needed")
    steps = np.diff(time)
    period = float(np.median(steps))
    holes = np.flatnonzero(steps > largest_bridged_step(period))
    borders = np.concatenate([[0], holes + 1, [len(time)]])
    pieces = [slice(int(a), int(b)) for a, b in itertools.pairwise(borders)]
    kept = [piece for piece in pieces if piece.stop - piece.start >= SHORTEST_SEGMENT]
    if len(holes):
        longest = float(steps[holes].max())
        remarks.append(
            f"{len(holes)} hole{'s' if len(holes) > 1 else ''} in the record (the longest {longest:g} s):"
            f" split into {len(pieces)} segments"
        )
    if not kept:
        raise InputError(
            f"{entry.path}: time jumps so often that no piece of {SHORTEST_SEGMENT} samples is left;"
            f" the typical step is {period:g} s"
        )
    if len(kept) < len(pieces):
        lost = sum(piece.stop - piece.start for piece in pieces) - sum(
            piece.stop - piece.start for piece in kept
        )
        remarks.append(f"{lost} samples in pieces shorter than {SHORTEST_SEGMENT} samples left out")
    longest_piece = max(kept, key=lambda piece: piece.stop - piece.start)
    line = time[longest_piece]
    period = float((line[-1] - line[0]) / (len(line) - 1)) if _uniform(line) else period
    if all(_uniform(time[piece], period) for piece in kept):
        segments = tuple(kept)
        fields = (time, raw.position, raw.command, raw.external, raw.temperature, raw.extra)
    else:
        segments, fields, filled = _resampled(raw, kept, period)
        remarks.append(f"time is not uniform: resampled to the median period of {period:g} s")
        if filled:
            remarks.append(f"{filled} missing samples bridged by local interpolation")
    position_command = fields[1], fields[2]
    return Session(
        entry, fields[0], *position_command, segments, period, fields[3], fields[4], fields[5], tuple(remarks)
    )


def _uniform(time: Array, period: float | None = None) -> bool:
    if period is None:
        period = float((time[-1] - time[0]) / (len(time) - 1))
    deviation = (time - time[0]) - period * np.arange(len(time))
    return bool(np.ptp(deviation) <= 2 * UNIFORM_WITHIN * period)


def _resampled(raw: RawSamples, pieces: list[slice], period: float):
    segments: list[slice] = []
    parts: list[tuple] = []
    start = filled = 0
    for piece in pieces:
        old = raw.time[piece]
        count = int(np.floor((old[-1] - old[0]) / period + 1e-6)) + 1
        new = old[0] + period * np.arange(count)
        filled += int(np.sum(np.maximum(np.round(np.diff(old) / period) - 1, 0)))
        linear = lambda values, old=old, new=new: interpolate(old, values, new, cubic=False)  # noqa: E731
        parts.append(
            (
                new,
                interpolate(old, raw.position[piece], new, cubic=True),
                linear(raw.command[piece]),
                None if raw.external is None else linear(raw.external[piece]),
                None if raw.temperature is None else linear(raw.temperature[piece]),
                {name: _extra(old, values[piece], new) for name, values in raw.extra.items()},
            )
        )
        segments.append(slice(start, start + count))
        start += count
    joined = [
        None if column[0] is None else np.concatenate(column) for column in list(zip(*parts, strict=True))[:5]
    ]
    extra = {name: np.concatenate([part[5][name] for part in parts]) for name in raw.extra}
    return tuple(segments), (*joined, extra), filled


def _extra(old: Array, values: NDArray, new: Array) -> NDArray:
    if values.dtype == object:
        return values[np.clip(np.searchsorted(old, new, side="right") - 1, 0, len(old) - 1)]
    return interpolate(old, values[:, None], new, cubic=False)[:, 0]


def interpolate(old: Array, values: Array, new: Array, cubic: bool) -> Array:
    """Interpolate columns at new instants from the nearest samples: two (linear) or four (cubic, Lagrange).

    old : (N,) increasing; values : (N, k); new : (M,) within old's range
    Returns (M, k).
    """
    points = 4 if cubic and len(old) >= 4 else 2
    first = np.clip(np.searchsorted(old, new, side="right") - points // 2, 0, len(old) - points)
    result = np.zeros((len(new), values.shape[1]))
    nodes = [old[first + i] for i in range(points)]
    for i in range(points):
        weight = np.ones(len(new))
        for j in range(points):
            if j != i:
                weight *= (new - nodes[j]) / (nodes[i] - nodes[j])
        result += weight[:, None] * values[first + i]
    return result
