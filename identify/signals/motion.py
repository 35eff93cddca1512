"""Blocks of motion: q, dq, ddq and what was measured with them, in bounded memory.

A session is cut into blocks of decimated samples. A block carries, beside its own rows, those that the
filters still need (their memory), so that blocks can be processed one by one, in any order and place, with
the result of the whole record.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from identify.recording import Session
from identify.signals import differentiation, parallel_filter, zero_phase
from identify.signals.settings import SignalSettings

Array = NDArray[np.float64]

LARGEST_BLOCK = 65536
"""Rows of a block, the overlap not counted, for one joint; divided among the joints when there are
several."""


@dataclass(frozen=True)
class MotionBlock:
    """Rows of one segment with the filters' overlap; the decimated samples that are this block's own."""

    segment: int
    """Index of the segment in the session."""
    rows: slice
    """Rows of the session that the block holds, the overlap included."""
    time: Array
    """(N,) s"""
    q: Array
    """(N, n) filtered position, rad or m"""
    dq: Array
    """(N, n) rad/s or m/s"""
    ddq: Array
    """(N, n) rad/s² or m/s²"""
    command: Array
    """(N, n) unit of the drive gain"""
    external: Array | None
    """(N, n) N m or N"""
    temperature: Array | None
    """(N, n) degC"""
    first: int
    """Row of the block where its first decimated sample lies."""
    count: int
    """Decimated samples of this block."""
    factor: int
    """Rows for one decimated sample."""
    cutoff: float
    """Hz, of the parallel filter."""
    sampling_period: float
    """s"""

    @property
    def decimated_time(self) -> Array:
        """(M,) s"""
        return self.at_decimated(self.time)

    def decimate(self, columns: Array) -> Array:
        """The parallel filter: low-pass columns (N, k) or (N,) of this block's rows and decimate them: (M,
        k) or (M,)."""
        table = columns.reshape(len(columns), -1)
        if len(table) != len(self.time):
            raise ValueError(f"columns have {len(table)} rows, the block has {len(self.time)}")
        result = parallel_filter.decimate(
            table, self.first, self.count, self.factor, self.cutoff, self.sampling_period
        )
        return result.reshape(self.count, *columns.shape[1:])

    def at_decimated(self, values: Array) -> Array:
        """Values (N, ...) at the decimated instants, picked without filtering: (M, ...)."""
        return values[self.first : self.first + self.factor * self.count : self.factor]


def motion_blocks(
    session: Session, settings: SignalSettings, largest_block: int | None = None
) -> Iterator[MotionBlock]:
    """The blocks of a session, one after the other.

    largest_block : rows, the overlap not counted
    """
    period = session.sampling_period
    factor = settings.decimation_factor(period)
    around = zero_phase.memory(settings.decimation_cutoff, period)
    largest = largest_block or max(LARGEST_BLOCK // session.n, 4 * around)
    per_block = max(1, largest // factor)
    edge = math.ceil(settings.edge() / period / factor)
    for index, segment in enumerate(session.segments):
        total = (segment.stop - segment.start - 1) // factor + 1
        for begin in range(edge, total - edge, per_block):
            count = min(per_block, total - edge - begin)
            first = segment.start + begin * factor
            last = first + (count - 1) * factor
            rows = slice(max(first - around, segment.start), min(last + around + 1, segment.stop))
            yield _block(session, settings, index, segment, rows, first - rows.start, count, factor)


def _block(
    session: Session,
    settings: SignalSettings,
    index: int,
    segment: slice,
    rows: slice,
    first: int,
    count: int,
    factor: int,
) -> MotionBlock:
    around = differentiation.memory(session.sampling_period, settings.position_cutoff)
    wide = slice(max(rows.start - around, segment.start), min(rows.stop + around, segment.stop))
    q, dq, ddq = differentiation.differentiate(
        np.asarray(session.position[wide]), session.sampling_period, settings.position_cutoff
    )
    own = slice(rows.start - wide.start, rows.stop - wide.start)
    return MotionBlock(
        segment=index,
        rows=rows,
        time=np.asarray(session.time[rows]),
        q=q[own],
        dq=dq[own],
        ddq=ddq[own],
        command=np.asarray(session.command[rows]),
        external=None if session.external is None else np.asarray(session.external[rows]),
        temperature=None if session.temperature is None else np.asarray(session.temperature[rows]),
        first=first,
        count=count,
        factor=factor,
        cutoff=settings.decimation_cutoff,
        sampling_period=session.sampling_period,
    )
