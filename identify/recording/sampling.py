"""Uniform time: segments without a hole, and resampling where the recorded time is not uniform.

Works through the session in blocks, so that it may be longer than memory.
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from identify.recording.errors import InputError
from identify.recording.interpolation import interpolate, previous
from identify.recording.position_jumps import mend_position_jumps
from identify.recording.quantiles import median
from identify.recording.samples import RawSamples, SampleColumns, release
from identify.recording.session import Session, SessionEntry

Array = NDArray[np.float64]

UNIFORM_WITHIN = 0.01
"""Of the period: a time within this of a uniform one is used as it is. Clocks are read that well;
interpolating would only add the error of interpolation."""
LARGEST_BRIDGED_SAMPLES = 5
LARGEST_BRIDGED_TIME = 0.010
"""s; at most so many missing samples in a row, and at most so long, are bridged by local interpolation.
Both lie well below the memory of the position filter (several hundredths of a second); a longer hole splits
the session."""
SMALLEST_HOLE = 2.5
"""Periods: a step in time up to this is jitter or a single missing sample, whatever the sampling rate."""
SLOWEST_SAMPLING = 0.5
"""s; robots are sampled a hundred times faster, and a step of seconds means that time is in another unit."""
SHORTEST_SEGMENT = 16
"""Samples; a shorter piece between two holes is left out."""
BLOCK = 1 << 18
"""Samples worked on at a time."""
STEPS_LOOKED_AT = 1 << 18


def largest_bridged_step(period: float) -> float:
    """The longest step in time, s, that is not a hole."""
    bridged = min(LARGEST_BRIDGED_SAMPLES * period, LARGEST_BRIDGED_TIME)
    return max(SMALLEST_HOLE * period, bridged + 1.5 * period)


@dataclass(frozen=True)
class _Piece:
    """A piece of the session without a hole, and how its clock ran."""

    rows: slice
    start: float
    """s"""
    period: float
    """s, of the clock"""
    samples: int
    """Samples that a clock without a miss would have given."""
    regular: bool
    """Whether every sample lies on the ticks of the clock, within what counts as uniform or the rounding of
    the file."""
    exact: bool
    """Whether every sample does without allowing for rounding."""

    @property
    def missing(self) -> int:
        return self.samples - (self.rows.stop - self.rows.start) if self.regular else 0


def uniform_session(entry: SessionEntry, raw: RawSamples) -> Session:
    """Make a session of uniform time within each segment out of the samples of a file.

    Raises InputError: no piece of the session is long enough to be used.
    """
    time = raw.time
    if len(time) < SHORTEST_SEGMENT:
        raise InputError(f"{entry.path}: holds {len(time)} samples; at least {SHORTEST_SEGMENT} are needed")
    step = _median_step(time)
    if step > SLOWEST_SAMPLING:
        raise InputError(
            f"{entry.path}: the typical step of time is {step:g} s, too long for a motion; time must be in seconds"
        )
    holes = _holes(time, step)
    jumps = mend_position_jumps(raw, step, largest_bridged_step(step))
    starts = {row + 1 for row in (*holes, *jumps.borders)} | {rows.start for rows in jumps.held}
    split = [slice(first, last) for first, last in itertools.pairwise(sorted({0, *starts, len(time)}))]
    measured = [rows for rows in split if not any(_inside(rows, held) for held in jumps.held)]
    kept = [rows for rows in measured if _long_enough(time, rows, step)]
    remarks = [*raw.remarks, *jumps.remarks, *_hole_remarks(time, holes), *_short_remarks(measured, kept)]
    if not kept:
        what = "the position" if jumps.borders and not holes else "time"
        raise InputError(
            f"{entry.path}: {what} jumps so often that no piece of {SHORTEST_SEGMENT} samples is left;"
            f" the typical step of time is {step:g} s"
        )
    rounding = _rounding(time, step)
    pieces = [_piece(time, rows, step, rounding) for rows in kept]
    period = max(pieces, key=lambda piece: piece.samples).period
    alike = all(abs(piece.period / period - 1) < UNIFORM_WITHIN / 10 for piece in pieces)
    missing = sum(piece.missing for piece in pieces)
    if alike and not missing and all(piece.regular for piece in pieces):
        if not all(piece.exact for piece in pieces):
            remarks.append(
                f"time is rounded to {2 * rounding:g} s: taken as uniform with a period of {period:g} s"
            )
            raw.time = _ticks(time, pieces)
        segments = tuple(kept)
    else:
        if not all(piece.regular for piece in pieces):
            remarks.append(f"time is not uniform: resampled to its median period of {period:g} s")
        if missing:
            part = missing / sum(piece.samples for piece in pieces)
            remarks.append(f"{missing} missing samples ({part:.2g} of all) bridged by local interpolation")
        raw, segments = _resampled(raw, pieces, period)
    return Session(
        entry=entry,
        time=raw.time,
        position=raw.position,
        command=raw.command,
        segments=segments,
        sampling_period=period,
        external=raw.external,
        temperature=raw.temperature,
        extra=raw.extra,
        remarks=tuple(remarks),
    )


def _long_enough(time: Array, rows: slice, step: float) -> bool:
    """Whether a piece has the samples of a segment, also once it is resampled to the typical step: time that all but stands
    still, as some loggers write it before their clock is set, is no motion."""
    if rows.stop - rows.start < SHORTEST_SEGMENT:
        return False
    return float(time[rows.stop - 1] - time[rows.start]) > 0.5 * SHORTEST_SEGMENT * step


def _median_step(time: Array) -> float:
    """The typical step in time, s; of a long session, the median of steps evenly spread over it."""
    rows = np.linspace(0, len(time) - 2, min(len(time) - 1, STEPS_LOOKED_AT)).astype(int)
    return median(time[rows + 1] - time[rows])


def _blocks(start: int, stop: int) -> Iterator[slice]:
    """Blocks of rows, each with the first row of the next."""
    for first in range(start, stop, BLOCK):
        yield slice(first, min(first + BLOCK + 1, stop))


def _several(rows: slice) -> bool:
    return rows.stop - rows.start > 1


def _holes(time: Array, step: float) -> list[int]:
    """The last row before each hole."""
    longest = largest_bridged_step(step)
    holes: list[int] = []
    for rows in _blocks(0, len(time)):
        holes.extend((rows.start + np.flatnonzero(np.diff(time[rows]) > longest)).tolist())
    return holes


def _inside(rows: slice, other: slice) -> bool:
    return other.start <= rows.start and rows.stop <= other.stop


def _hole_remarks(time: Array, holes: list[int]) -> list[str]:
    if not holes:
        return []
    where = ", ".join(f"{time[row]:.6g} s" for row in holes[:3]) + (" ..." if len(holes) > 3 else "")
    longest = max(float(time[row + 1] - time[row]) for row in holes)
    count = "1 hole" if len(holes) == 1 else f"{len(holes)} holes"
    return [
        f"{count} in the record (after {where}; the longest {longest:.3g} s):"
        f" split into {len(holes) + 1} segments, nothing interpolated across"
    ]


def _short_remarks(split: list[slice], kept: list[slice]) -> list[str]:
    lost = sum(rows.stop - rows.start for rows in split if rows not in kept)
    return [f"{lost} samples in pieces of less than {SHORTEST_SEGMENT} samples left out"] if lost else []


def _rounding(time: Array, step: float) -> float:
    """Half the unit of the last decimal that times are written with, s; 0 if they are not on a decimal grid.

    Times of a 3 kHz clock written with four decimals are 0.0003, 0.0007, 0.0010: the clock was regular all
    the same.
    """
    sample = np.asarray(time[: 4 * BLOCK : max(1, min(len(time), 4 * BLOCK) // 4096)])
    for decimals in range(9):
        unit = 10.0**-decimals
        if unit > 0.5 * step:
            continue
        if np.all(np.abs(sample / unit - np.round(sample / unit)) < 1e-4):
            return 0.5 * unit
    return 0.0


def _piece(time: Array, rows: slice, step: float, rounding: float) -> _Piece:
    """Read the clock of a piece: its period, and whether samples lie on its ticks."""
    start, tick, counted = float(time[rows.start]), 0, True
    for block in _blocks(rows.start, rows.stop):
        if _several(block):
            steps = np.round(np.diff(time[block]) / step)
            counted = counted and bool((steps >= 1).all())
            tick += int(steps.sum())
    span = float(time[rows.stop - 1]) - start
    period = span / tick
    within = max(UNIFORM_WITHIN * period, rounding * 1.01)
    low, high = math.inf, -math.inf
    for block in _blocks(rows.start, rows.stop):
        beside = (time[block] - start) / period
        beside = (beside - np.round(beside)) * period
        low, high = min(low, float(beside.min())), max(high, float(beside.max()))
    if counted and high - low <= 2 * within:
        exact = high - low <= 2 * UNIFORM_WITHIN * period
        return _Piece(rows, start, period, tick + 1, regular=True, exact=exact)
    return _Piece(rows, start, step, math.floor(span / step + 1e-6) + 1, regular=False, exact=False)


def _instants(start: float, period: float, first: int, last: int) -> Array:
    return start + period * np.arange(first, last, dtype=np.float64)


def _ticks(time: Array, pieces: list[_Piece]) -> Array:
    """Time with every kept sample on the tick of its clock."""
    ticks = SampleColumns()
    row = 0
    for piece in pieces:
        ticks.append(np.asarray(time[row : piece.rows.start]))
        for block in range(0, piece.samples, BLOCK):
            ticks.append(_instants(piece.start, piece.period, block, min(block + BLOCK, piece.samples)))
        row = piece.rows.stop
    ticks.append(np.asarray(time[row:]))
    return ticks.array()


def _resampled(raw: RawSamples, pieces: list[_Piece], period: float) -> tuple[RawSamples, tuple[slice, ...]]:
    """All pieces at one period: cubic interpolation for positions, linear for what else was measured."""
    n = raw.position.shape[1]
    numeric = {name: values for name, values in raw.extra.items() if values.dtype != object}
    texts: dict[str, list[NDArray[Any]]] = {name: [] for name in raw.extra if name not in numeric}
    sources = {"position": raw.position, "command": raw.command, "external": raw.external} | {
        "temperature": raw.temperature
    }
    stores = {name: SampleColumns(n) for name, values in sources.items() if values is not None}
    extras = {name: SampleColumns() for name in numeric}
    time = SampleColumns()
    segments: list[slice] = []
    for piece in pieces:
        step = (
            piece.period if piece.regular and abs(piece.period / period - 1) < UNIFORM_WITHIN / 10 else period
        )
        count = math.floor((piece.samples - 1) * piece.period / step + 1e-6) + 1
        segments.append(slice(time.rows, time.rows + count))
        for first in range(0, count, BLOCK):
            new = _instants(piece.start, step, first, min(first + BLOCK, count))
            rows, old = _around(raw.time, piece, new)
            time.append(new)
            for name, store in stores.items():
                values = np.asarray(sources[name][rows])  # type: ignore[index]
                store.append(interpolate(old, values, new, cubic=name == "position"))
            for name, store in extras.items():
                store.append(interpolate(old, numeric[name][rows][:, None], new, cubic=False)[:, 0])
            for name, parts in texts.items():
                parts.append(previous(old, raw.extra[name][rows], new))
            for values in (raw.time, raw.position, raw.command):
                release(values)
    read = {name: store.array() for name, store in stores.items()}
    extra: dict[str, NDArray[Any]] = {name: store.array() for name, store in extras.items()}
    extra |= {name: np.concatenate(parts) for name, parts in texts.items()}
    resampled = RawSamples(
        time.array(), read["position"], read["command"], read.get("external"), read.get("temperature"), extra
    )
    return resampled, tuple(segments)


def _around(time: Array, piece: _Piece, new: Array) -> tuple[slice, Array]:
    """Rows of a piece that new instants are interpolated from, and their times (on the ticks of a regular
    clock)."""
    margin = 2 * piece.period
    recorded = time[piece.rows]
    first = max(int(np.searchsorted(recorded, new[0] - margin)) - 4, 0)
    last = min(int(np.searchsorted(recorded, new[-1] + margin)) + 4, len(recorded))
    old = np.array(recorded[first:last])
    if piece.regular:
        old = piece.start + piece.period * np.round((old - piece.start) / piece.period)
    return slice(piece.rows.start + first, piece.rows.start + last), old
