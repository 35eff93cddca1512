"""One pass over the samples: columns of the model and of every candidate, filtered, decimated, reduced to factors.

Idea 4 of the design: a block of time of one session and one joint becomes the triangular factor of [W  Y  tau].
Sessions are independent of each other, so they may be reduced anywhere (`identify.estimation.executor`).
"""

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field
from functools import cached_property, partial
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from identify.estimation import forked
from identify.estimation.context import FittedTorque, Slot, rows_of
from identify.estimation.decimated_rows import ColumnTable, DecimatedRows, decimated_rows
from identify.estimation.executor import chosen_executor
from identify.estimation.record import Record
from identify.estimation.reversal_noise import ReversalNoise
from identify.estimation.triangular_factor import TriangularFactor
from identify.recording import SessionEntry

__all__ = ["FittedTorque", "Observation", "ReversalNoise", "Slot", "TimeBlock", "observe", "rows_of"]

Array = NDArray[np.float64]

BLOCKS_PER_SESSION = 40
SHORTEST_BLOCK = 0.2
"""s. Blocks are the folds of cross-validation and the clusters of the robust deviations: many are wanted, but each
longer than what is left of a residual's memory after the filters."""


@dataclass(frozen=True)
class TimeBlock:
    """A block of time of one session."""

    session: int
    """index among the observed sessions"""
    start: float
    stop: float


@dataclass(eq=False)
class Observation:
    """Factors of every block and joint.

    slots          : the groups of columns, behind the base parameters
    slot_columns   : global column indices of each slot
    joint_columns  : for every joint the global indices of the columns on its rows
    blocks         : blocks of time
    factors        : factors[block][joint], columns: joint_columns[joint], then Y, then tau
    """

    entries: list[SessionEntry]
    base: int
    slots: list[Slot]
    slot_columns: list[NDArray[np.intp]]
    joint_columns: list[NDArray[np.intp]]
    blocks: list[TimeBlock]
    factors: list[list[TriangularFactor]]
    _whole: dict[int, TriangularFactor] = field(default_factory=dict)
    _stacked: dict[int, "StackedFactors"] = field(default_factory=dict)

    @cached_property
    def width(self) -> int:
        """Number of columns of W."""
        return self.base + sum(len(columns) for columns in self.slot_columns)

    @cached_property
    def sessions(self) -> NDArray[np.intp]:
        """(blocks,) index of the session of every block."""
        return np.array([block.session for block in self.blocks], np.intp)

    @cached_property
    def samples(self) -> NDArray[np.intp]:
        """(joints,) number of the samples behind the factors of every joint."""
        counts = np.array([[factor.rows for factor in of_block] for of_block in self.factors], np.intp)
        return np.asarray(counts.sum(axis=0), np.intp)

    def blocks_of(self, session: int) -> list[int]:
        """Indices of the blocks of a session."""
        return [index for index, block in enumerate(self.blocks) if block.session == session]

    def on_rows(self, joint: int, columns: NDArray[np.intp]) -> NDArray[np.intp]:
        """Places among a joint's columns of those of some global columns that stand on its rows."""
        there = self.joint_columns[joint]
        place = np.full(max(self.width, int(np.max(columns, initial=0)) + 1), -1, np.intp)
        place[there] = np.arange(len(there))
        places = place[columns]
        return places[places >= 0]

    def stacked(self, joint: int) -> "StackedFactors":
        """The factors of a joint's blocks under each other, so that columns are picked from all of them at once; the factors
        are views of them from then on."""
        if joint not in self._stacked:
            listed = [factors[joint] for factors in self.factors]
            edges = np.concatenate([[0], np.cumsum([len(factor.r) for factor in listed])]).astype(np.intp)
            rows = np.vstack([factor.r for factor in listed])
            self._stacked[joint] = StackedFactors(rows, edges)
            for factors, (first, last) in zip(self.factors, pairwise(edges.tolist()), strict=True):
                factors[joint] = TriangularFactor(rows[first:last], factors[joint].rows)
        return self._stacked[joint]

    def merged(self, joint: int, blocks: Sequence[int] | None = None) -> TriangularFactor:
        """Factor of a joint over several blocks (all of them if not said)."""
        if blocks is None:
            if joint not in self._whole:
                self._whole[joint] = self._merge(joint, range(len(self.blocks)))
            return self._whole[joint]
        return self._merge(joint, blocks)

    def _merge(self, joint: int, blocks: Sequence[int]) -> TriangularFactor:
        return TriangularFactor.merge(
            (self.factors[block][joint] for block in blocks), len(self.joint_columns[joint]) + 2
        )


@dataclass(frozen=True, eq=False)
class StackedFactors:
    """Triangular factors of several blocks under each other.

    rows  : (sum of k, columns)
    edges : (blocks + 1,) first row of every block, and the number of rows
    """

    rows: Array
    edges: NDArray[np.intp]

    @property
    def block(self) -> NDArray[np.intp]:
        """(sum of k,) index of the block that a row belongs to."""
        return np.repeat(np.arange(len(self.edges) - 1), np.diff(self.edges))

    def sums(self, values: Array) -> Array:
        """(blocks, k) sums over the rows of every block, of values (sum of k, k)."""
        totals = np.zeros((len(self.edges) - 1, values.shape[1]))
        filled = np.flatnonzero(np.diff(self.edges))
        if len(filled):
            totals[filled] = np.add.reduceat(values, self.edges[filled], axis=0)
        return totals

    def of_blocks(self, columns: Sequence[int] | NDArray[np.intp]) -> list[Array]:
        """Some columns of every block's factor, (k, columns) each."""
        picked = np.take(self.rows, columns, axis=1)
        return [picked[first:last] for first, last in pairwise(self.edges.tolist())]


@dataclass(frozen=True)
class SessionFactors:
    """What one session is reduced to: its blocks of time (start, stop) and their factors by joint."""

    table: ColumnTable
    spans: list[tuple[float, float]]
    factors: list[list[TriangularFactor]]


def observe(
    record: Record,
    entries: Sequence[SessionEntry],
    slots: Sequence[Slot],
    fitted: FittedTorque | None = None,
    reversals: ReversalNoise | None = None,
    by_joint: bool = False,
) -> Observation:
    """Pass once over the samples of some sessions and reduce them to factors, where the executor says (`computed_by`).

    fitted    : the model that columns of load-dependent effects take the load from
    reversals : weigh samples by what is not known of the instants of reversal; all samples alike if not given
    by_joint  : divide the joints among processes that go side by side here, which pays for many columns
    """
    listed = list(entries)
    of_session = partial(_observe_session, record, list(slots), fitted, reversals)
    processes = min(forked.dividing(), record.joints) if by_joint else 1
    if processes < 2:
        return assemble(listed, list(slots), list(chosen_executor()(of_session, listed)))

    def of_joints(place: int) -> list[SessionFactors]:
        return [of_session(entry, range(place, record.joints, processes)) for entry in listed]

    # the columns of a joint stay where they were computed, for the next pass
    parts = zip(*forked.each(of_joints, range(processes), kept=True), strict=True)
    return assemble(listed, list(slots), [_merged(record, of_one) for of_one in parts])


def _observe_session(
    record: Record,
    slots: list[Slot],
    fitted: FittedTorque | None,
    reversals: ReversalNoise | None,
    entry: SessionEntry,
    joints: Sequence[int] | None = None,
) -> SessionFactors:
    return reduce_rows(record, entry, decimated_rows(record, entry, slots, fitted, reversals, joints))


def _merged(record: Record, parts: Sequence[SessionFactors]) -> SessionFactors:
    """Of all joints, from parts that each have the rows of every so manieth."""
    factors = [
        [of_parts[joint % len(parts)][joint // len(parts)] for joint in range(record.joints)]
        for of_parts in zip(*(part.factors for part in parts), strict=True)
    ]
    return SessionFactors(ColumnTable.merged(record, [part.table for part in parts]), parts[0].spans, factors)


def assemble(
    entries: list[SessionEntry], slots: list[Slot], sessions: Sequence[SessionFactors]
) -> Observation:
    """The observation of sessions that were reduced one by one."""
    table = sessions[0].table
    return Observation(
        entries=entries,
        base=table.base,
        slots=slots,
        slot_columns=table.slot_columns,
        joint_columns=table.joint_columns,
        blocks=[TimeBlock(index, *span) for index, session in enumerate(sessions) for span in session.spans],
        factors=[factors for session in sessions for factors in session.factors],
    )


def reduce_rows(record: Record, entry: SessionEntry, blocks: Iterable[DecimatedRows]) -> SessionFactors:
    """Reduce a session's rows to a factor for each block of time and joint; joints at rest are left out."""
    edges = block_edges(record, entry)
    open_rows: dict[int, list[list[Array]]] = {}
    spans: list[tuple[float, float]] = []
    factors: list[list[TriangularFactor]] = []
    table: ColumnTable | None = None

    def close(numbers: Sequence[int]) -> None:
        for number in numbers:
            parts = open_rows.pop(number)
            spans.append((float(edges[number]), float(edges[number + 1])))
            factors.append([TriangularFactor.of(np.concatenate(part)) for part in parts])

    for block in blocks:
        table = block.table
        place = np.clip(np.searchsorted(edges, block.time, side="right") - 1, 0, len(edges) - 2)
        borders = [0, *(np.flatnonzero(np.diff(place)) + 1).tolist(), len(place)]
        for first, last in pairwise(borders):
            parts = open_rows.setdefault(int(place[first]), [[] for _ in block.rows])
            for joint, rows in enumerate(block.rows):
                parts[joint].append(rows[first:last][block.moving[first:last, joint]])
        close(sorted(open_rows)[:-1])  # no later sample falls into these
    close(sorted(open_rows))
    assert table is not None  # a session without a block is refused by `Record.blocks`
    return SessionFactors(table, spans, factors)


def block_edges(record: Record, entry: SessionEntry) -> Array:
    """Instants that cut a session into blocks of time."""
    facts = record.facts(entry)
    count = int(np.clip(facts.duration / SHORTEST_BLOCK, 4, BLOCKS_PER_SESSION))
    return np.linspace(facts.start, facts.start + facts.duration, count + 1)
