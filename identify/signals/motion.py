"""Blocks of motion: q, dq, ddq and what was measured with them, in bounded memory.

A session is cut into blocks of decimated samples. A block carries, beside its own rows, those that the
filters still need (their memory), so that blocks can be processed one by one, in any order and place, with
the result of the whole session.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from identify.recording import InputError, Session
from identify.recording.samples import release
from identify.signals import differentiation, parallel_filter, zero_phase
from identify.signals.position_noise import SAMPLES, position_rounding, position_step
from identify.signals.reversals import Reversals, direction_of_motion, find_reversals
from identify.signals.settings import SignalSettings

Array = NDArray[np.float64]

LARGEST_BLOCK = 32768
"""Rows of a block, the overlap not counted, for one joint; divided among the joints when there are
several."""
FEWEST_DECIMATED = 4
"""A segment that would give fewer decimated samples is left out."""


@dataclass(frozen=True, eq=False)
class MotionBlock:
    """Rows of one segment with the filters' overlap; the decimated samples that are this block's own."""

    segment: int
    """Index of the segment in the session."""
    rows: slice
    """Rows of the session that the block holds, the overlap included; every `rows.step`-th of a fast
    session."""
    time: Array
    """(N,) s"""
    position: Array
    """(N, n) position as recorded, rad or m"""
    q: Array
    """(N, n) filtered position, rad or m"""
    dq: Array
    """(N, n) rad/s or m/s"""
    ddq: Array
    """(N, n) rad/s² or m/s²"""
    direction: Array
    """(N, n) sign of the velocity, -1 to 1: of dq, but turning where the positions as recorded turn"""
    reversals: tuple[Reversals, ...]
    """Of each joint, in rows of the block"""
    command: Array
    """(N, n) unit of the drive gain"""
    external: Array | None
    """(N, n) N m or N"""
    temperature: Array | None
    """(N, n) °C"""
    first: int
    """Row of the block where its first decimated sample lies."""
    count: int
    """Decimated samples of this block, M."""
    factor: int
    """Rows for one decimated sample."""
    cutoff: float
    """Hz, of the parallel filter."""
    sampling_period: float
    """s, of the rows."""
    shared: Array | None = None
    """(n, k) of motors that several joints share: their angles are q @ shared"""
    shared_direction: Array | None = None
    """(N, k) of these motors, as `direction` is of the joints"""

    @property
    def turns(self) -> Array:
        """(R, 2) of every reversal the joint, and the deviation of its instant, s"""
        of_joints = [
            np.column_stack(
                [np.full(len(each.deviation), float(joint)), each.deviation * self.sampling_period]
            )
            for joint, each in enumerate(self.reversals)
        ]
        return np.vstack(of_joints)

    @property
    def decimated_time(self) -> Array:
        """(M,) s"""
        return self.at_decimated(self.time)

    def decimate(self, columns: Array) -> Array:
        """The parallel filter: low-pass columns (N, ...) of this block's rows and decimate them: (M, ...)."""
        if len(columns) != len(self.time):
            raise ValueError(f"columns have {len(columns)} rows, the block has {len(self.time)}")
        table = columns.reshape(len(columns), -1)
        result = parallel_filter.decimate(
            table, self.first, self.count, self.factor, self.cutoff, self.sampling_period
        )
        return result.reshape(self.count, *columns.shape[1:])

    def decimate_tables(self, tables: Sequence[Array]) -> Array:
        """The same for several tables (N, k_i) side by side: (M, sum of k_i)."""
        return parallel_filter.decimate_tables(
            tables, self.first, self.count, self.factor, self.cutoff, self.sampling_period
        )

    def at_decimated(self, values: Array) -> Array:
        """Values (N, ...) at the decimated instants, picked without filtering: (M, ...)."""
        return values[self.first : self.first + self.factor * self.count : self.factor]


@dataclass(frozen=True)
class _Grid:
    """How the rows of a session become rows of blocks and decimated samples."""

    stride: int
    """Samples of the session for one row."""
    period: float
    """s, of the rows."""
    factor: int
    """Rows for one decimated sample."""
    edge: int
    """Decimated samples trimmed at each end of a segment."""
    around: int
    """Rows that the parallel filter reaches to each side."""

    @classmethod
    def of(cls, session: Session, settings: SignalSettings) -> _Grid:
        stride = settings.stride(session.sampling_period)
        period = stride * session.sampling_period
        factor = parallel_filter.decimation_factor(settings.decimation_cutoff, period)
        edge = math.ceil(settings.edge() / (period * factor))
        return cls(stride, period, factor, edge, zero_phase.memory(settings.decimation_cutoff, period))

    def decimated(self, segment: slice) -> range:
        """Indices of the decimated samples of a segment, counted from its start, that are kept."""
        rows = (segment.stop - segment.start - 1) // self.stride + 1
        kept = range(self.edge, (rows - 1) // self.factor + 1 - self.edge)
        return kept if len(kept) >= FEWEST_DECIMATED else range(0)


def motion_blocks(
    session: Session,
    settings: SignalSettings,
    largest_block: int | None = None,
    shared: Array | None = None,
) -> Iterator[MotionBlock]:
    """The blocks of a session, one after the other.

    largest_block : rows, the overlap not counted; the default keeps a block within some ten megabytes
    shared        : (n, k) of motors that several joints share, where there are any: their angles are position @ shared

    Raises InputError: every segment is shorter than the filters need.
    """
    grid = _Grid.of(session, settings)
    kept = [(index, segment, grid.decimated(segment)) for index, segment in enumerate(session.segments)]
    if not any(len(decimated) for _, _, decimated in kept):
        longest = max(segment.stop - segment.start for segment in session.segments) * session.sampling_period
        least = (2 * grid.edge + FEWEST_DECIMATED) * grid.factor * grid.period
        raise InputError(
            f"{session.entry.path}: {longest:.3g} s without a hole are too short for the filters, which need"
            f" {least:.3g} s (position {min(settings.position_cutoff):g} Hz, parallel"
            f" {settings.decimation_cutoff:g} Hz); record longer, or set higher cut-offs under 'signals'"
        )
    largest = largest_block or max(LARGEST_BLOCK // session.n, 4 * grid.around)
    per_block = max(1, largest // grid.factor)
    rounding = _rounding(session, shared)
    for index, segment, decimated in kept:
        for begin in range(decimated.start, decimated.stop, per_block):
            piece = decimated[begin - decimated.start :][:per_block]
            yield _block(session, settings, grid, rounding, index, segment, piece, shared)
            for array in (session.time, session.position, session.command):
                release(array)


def left_out(session: Session, settings: SignalSettings) -> tuple[str, ...]:
    """What of a session the filters leave out, in words; empty if only the edges of the session."""
    grid = _Grid.of(session, settings)
    short = [segment for segment in session.segments if not grid.decimated(segment)]
    if not short:
        return ()
    seconds = sum(segment.stop - segment.start for segment in short) * session.sampling_period
    pieces = "1 segment" if len(short) == 1 else f"{len(short)} segments"
    return (f"{session.entry.file}: {pieces} ({seconds:.3g} s) too short for the filters, left out",)


def _block(
    session: Session,
    settings: SignalSettings,
    grid: _Grid,
    rounding: Array,
    index: int,
    segment: slice,
    outputs: range,
    shared: Array | None,
) -> MotionBlock:
    rows_in_segment = (segment.stop - segment.start - 1) // grid.stride + 1
    first = max(outputs.start * grid.factor - grid.around, 0)
    last = min((outputs.stop - 1) * grid.factor + grid.around, rows_in_segment - 1)
    start, stop = segment.start + first * grid.stride, segment.start + last * grid.stride + 1

    around = differentiation.memory(session.sampling_period, settings.position_cutoff)
    wide = slice(max(start - around, segment.start), min(stop + around, segment.stop))
    recorded = np.asarray(session.position[wide])
    derivatives = differentiation.differentiate(recorded, session.sampling_period, settings.position_cutoff)

    def turning(course: Array, velocity: Array, cutoff: float, coarse: float) -> Reversals:
        reversals = find_reversals(course, velocity, cutoff, session.sampling_period, coarse)
        return reversals.in_rows(start - wide.start, grid.stride)

    reversals = tuple(
        turning(recorded[:, joint], derivatives[1][:, joint], cutoff, rounding[joint])
        for joint, cutoff in enumerate(settings.position_cutoff)
    )
    q, dq, ddq = (values[start - wide.start : stop - wide.start : grid.stride] for values in derivatives)

    def measured(values: Array | None) -> Array | None:
        return (
            None if values is None else _at_rows(values, start, stop, segment, grid, session.sampling_period)
        )

    shared_direction = None
    if shared is not None:
        turns = [
            turning(
                recorded @ joints,
                derivatives[1] @ joints,
                min(np.asarray(settings.position_cutoff)[joints != 0]),
                rounding[session.n + motor],
            )
            for motor, joints in enumerate(shared.T)
        ]
        shared_direction = direction_of_motion(dq @ shared, turns)
    command = measured(session.command)
    assert command is not None
    rows = slice(start, stop, grid.stride)
    return MotionBlock(
        segment=index,
        rows=rows,
        time=np.array(session.time[rows]),
        position=np.array(session.position[rows]),
        q=q,
        dq=dq,
        ddq=ddq,
        direction=direction_of_motion(dq, reversals),
        reversals=reversals,
        command=command,
        external=measured(session.external),
        temperature=measured(session.temperature),
        first=outputs.start * grid.factor - first,
        count=len(outputs),
        factor=grid.factor,
        cutoff=settings.decimation_cutoff,
        sampling_period=grid.period,
        shared=shared,
        shared_direction=shared_direction,
    )


def _rounding(session: Session, shared: Array | None) -> Array:
    """(n + k,) step of the encoder, or of a rounding that would scatter the positions alike; of the joints, then of the
    shared motors."""
    first = np.array(session.position[session.segments[0]][:SAMPLES])
    release(session.position)
    if shared is not None:
        first = np.hstack([first, first @ shared])
    step = position_step(first)
    return np.maximum(np.where(np.isfinite(step), step, 0.0), position_rounding(first))


ANTI_ALIAS = 0.25
"""Of the rate of the rows: cut-off of the filter that keeps faster content of the measured columns out of
them."""


def _at_rows(values: Array, start: int, stop: int, segment: slice, grid: _Grid, period: float) -> Array:
    """Measured columns at the rows of a block: as recorded, or low-passed first where rows are left out
    between."""
    if grid.stride == 1:
        return np.array(values[start:stop])
    cutoff = ANTI_ALIAS / grid.period
    around = zero_phase.memory(cutoff, period)
    wide = slice(max(start - around, segment.start), min(stop + around, segment.stop))
    count = (stop - start - 1) // grid.stride + 1
    return parallel_filter.decimate(
        np.asarray(values[wide]), start - wide.start, count, grid.stride, cutoff, period
    )
