"""Rows on SYNC: the frames of a bus, in the order of the bus, become one row per SYNC cycle.

Bus order decides; nothing is sorted and nothing is filled in. A drive samples at SYNC k and answers between
SYNC k and SYNC k+1, hence:

- what comes between two SYNCs belongs to the first of them;
- *late*: when a column comes twice in one cycle and was missing in the cycle before, the first of the two
  belongs to the cycle before;
- *lost SYNC*: when most columns come twice in one cycle, were there in the cycle before, and the cycle lasted
  as long as several, a SYNC was not seen. Only then is time asked: the cycle is cut into equal parts. Cutting
  by time alone would invent rows whenever SYNC itself stalls;
- *surplus*: any further repetition; the newest is kept.

What bus order cannot tell: a late answer whose successor is lost looks as a lost one followed by one in time. Of
one in a hundred lost and one in a hundred late, that is one row in ten thousand, whose value is one cycle old.

Hence row k is final when SYNC k+2 has come. There is no loop over frames.
"""

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import NDArray

from daq.json_object import JsonObject
from drivers.sync_producer import SYNC_ID

_PENDING = np.dtype([("column", "<i4"), ("seen", "?"), ("stamp", "<i8"), ("data", "u1", (8,))])


@dataclass(frozen=True)
class AlignedRows:
    """M rows of K columns, one column for each PDO that is expected in every cycle."""

    cycle: NDArray[np.int64]
    """(M,) index of the SYNC"""
    sync_time: NDArray[np.int64]
    """(M,) ns, stamp of the SYNC"""
    sync_seen: NDArray[np.bool_]
    """(M,) false where the SYNC was lost and its time is interpolated"""
    data: NDArray[np.uint8]
    """(M, K, 8) bytes of the PDOs, zero where none came"""
    came: NDArray[np.bool_]
    """(M, K)"""
    late: NDArray[np.bool_]
    """(M, K) came, but only after the next SYNC"""
    surplus: NDArray[np.bool_]
    """(M, K) came more than once; the newest is here"""

    def __len__(self) -> int:
        return len(self.cycle)


@dataclass
class AlignmentCounters:
    """What went wrong on the bus so far, per column where there is one number for each."""

    lost: NDArray[np.int64]
    """PDOs that never came"""
    late: NDArray[np.int64]
    """PDOs that came after the next SYNC"""
    surplus: NDArray[np.int64]
    """PDOs that came once too often and were discarded"""
    lost_sync: int = 0
    """SYNCs that were not seen"""
    before_first_sync: int = 0
    """PDOs before the first SYNC, discarded"""
    too_short: int = 0
    """PDOs with less data than their mapping, discarded"""

    def to_json(self) -> JsonObject:
        """Plain numbers and lists."""
        return {
            "lost": self.lost.tolist(),
            "late": self.late.tolist(),
            "surplus": self.surplus.tolist(),
            "lost_sync": self.lost_sync,
            "before_first_sync": self.before_first_sync,
            "too_short": self.too_short,
        }


@dataclass
class SyncAlignment:
    """Aligns blocks of frames as they come.

    columns : CAN id of each expected PDO -> its length in bytes; the order gives the columns' numbers
    period : s, nominal time from SYNC to SYNC
    """

    columns: Mapping[int, int]
    period: float
    sync_id: int = SYNC_ID
    counters: AlignmentCounters = field(init=False)

    def __post_init__(self) -> None:
        count = len(self.columns)
        self.counters = AlignmentCounters(
            lost=np.zeros(count, np.int64), late=np.zeros(count, np.int64), surplus=np.zeros(count, np.int64)
        )
        self._count = count
        # 11-bit ids: a table is the quickest dictionary. -1 is nobody's column, `count` is SYNC's.
        self._column_of_id = np.full(0x800, -1, np.int32)
        self._column_of_id[list(self.columns)] = np.arange(count)
        self._column_of_id[self.sync_id] = count
        self._length = np.array([*self.columns.values(), 0])
        self._pending = np.empty(0, _PENDING)
        self._next_cycle = 0
        # The first cycle has no predecessor that could lack anything.
        self._came_before = np.ones(count, np.int64)

    def feed(self, frames: NDArray[Any]) -> AlignedRows:
        """Take frames (N,) in bus order; the rows that have become final."""
        new = self._select(frames)
        self._pending = np.concatenate([self._pending, new]) if len(self._pending) else new
        return self._align(final=False)

    def flush(self) -> AlignedRows:
        """The rows that waited for the next SYNC, when none will come."""
        return self._align(final=True)

    def _select(self, frames: NDArray[Any]) -> NDArray[Any]:
        """SYNCs and expected PDOs, with their column."""
        identifier = frames["can_id"]
        # Flags: data frames with 11-bit ids only. Our own echo (SYNC) is welcome.
        usable = (identifier < 0x800) & ((frames["flags"] & 0x07) == 0)
        column = np.where(usable, self._column_of_id[identifier & 0x7FF], -1)
        short = (column >= 0) & (frames["length"] < self._length[column])
        self.counters.too_short += int(np.count_nonzero(short))
        keep = (column >= 0) & ~short
        selected = np.empty(np.count_nonzero(keep), _PENDING)
        selected["column"] = column[keep]
        selected["seen"] = True
        selected["stamp"] = frames["stamp"][keep]
        selected["data"] = frames["data"][keep, :8]
        if self._next_cycle == 0 and not len(self._pending):
            sync = np.flatnonzero(selected["column"] == self._count)
            first = int(sync[0]) if len(sync) else len(selected)
            self.counters.before_first_sync += first
            selected = selected[first:]
        return selected

    def _align(self, final: bool) -> AlignedRows:
        """Rows of the pending cycles: all but the last two, or all of them when nothing more will come.

        The pending frames begin with the SYNC of the next row.
        """
        self._insert_lost_syncs()
        sync = np.flatnonzero(self._pending["column"] == self._count)
        cycles = len(sync)
        rows = cycles if final else cycles - 2
        if rows <= 0:
            return self._empty()
        counts = self._counts(sync)
        before = np.vstack([self._came_before, counts[:-1]])
        first_is_late = (counts >= 2) & (before == 0)

        pdo = np.flatnonzero(self._pending["column"] < self._count)
        cycle = np.searchsorted(sync, pdo, side="right") - 1
        key = cycle * self._count + self._pending["column"][pdo]
        # Where an index repeats, the last assignment wins; reversed, it is the first frame.
        first_of_key = np.full(cycles * self._count, -1)
        first_of_key[key[::-1]] = pdo[::-1]
        last_of_key = np.full(cycles * self._count, -1)
        last_of_key[key] = pdo

        source = last_of_key.reshape(cycles, self._count)
        late_source = np.where(first_is_late, first_of_key.reshape(cycles, self._count), -1)
        # A late PDO of row k stands in cycle k+1, which is there for every row that is final.
        late = np.zeros((cycles, self._count), bool)
        late[:-1] = late_source[1:] >= 0
        source[:-1] = np.where(late[:-1], late_source[1:], source[:-1])

        source = source[:rows]
        came = source >= 0
        data = self._pending["data"][source]
        data[~came] = 0
        on_time = counts[:rows] - first_is_late[:rows]
        result = AlignedRows(
            cycle=np.arange(self._next_cycle, self._next_cycle + rows),
            sync_time=self._pending["stamp"][sync[:rows]],
            sync_seen=self._pending["seen"][sync[:rows]],
            data=data,
            came=came,
            late=late[:rows],
            surplus=on_time > 1,
        )
        self.counters.lost += np.count_nonzero(~came, axis=0)
        self.counters.late += np.count_nonzero(result.late, axis=0)
        self.counters.surplus += np.maximum(on_time - 1, 0).sum(axis=0)
        self.counters.lost_sync += int(np.count_nonzero(~result.sync_seen))
        self._next_cycle += rows
        self._came_before = counts[rows - 1]
        self._pending = self._pending[:0] if rows == cycles else self._pending[sync[rows] :].copy()
        return result

    def _counts(self, sync: NDArray[np.int64]) -> NDArray[np.int64]:
        """(cycles, K): how often each column came in each pending cycle."""
        pdo = np.flatnonzero(self._pending["column"] < self._count)
        cycle = np.searchsorted(sync, pdo, side="right") - 1
        key = cycle * self._count + self._pending["column"][pdo]
        return np.bincount(key, minlength=len(sync) * self._count).reshape(len(sync), self._count)

    def _insert_lost_syncs(self) -> None:
        """Put a SYNC, marked as not seen, where one was lost in a pending cycle that is complete.

        From the oldest to the newest, so that it does not matter in which blocks the frames came.
        """
        while True:
            sync = np.flatnonzero(self._pending["column"] == self._count)
            stamp = self._pending["stamp"][sync]
            # By the clock, so many SYNCs are missing; a healthy cycle lacks none.
            missing = np.rint(np.diff(stamp) / (self.period * 1e9)).astype(int) - 1
            if not (missing > 0).any():
                return
            counts = self._counts(sync)
            before = np.vstack([self._came_before, counts[:-1]])
            twice = np.count_nonzero((counts >= 2) & (before > 0), axis=1)[:-1]
            lost = np.flatnonzero((missing > 0) & (2 * twice > self._count))
            if not len(lost):
                return
            cycle = int(lost[0])
            self._cut(sync[cycle], sync[cycle + 1], min(int(missing[cycle]), int(counts[cycle].max()) - 1))

    def _cut(self, begin: int, end: int, cuts: int) -> None:
        """Insert `cuts` SYNCs, evenly in time, between the SYNCs at places `begin` and `end`."""
        first, last = int(self._pending["stamp"][begin]), int(self._pending["stamp"][end])
        syncs = np.zeros(cuts, _PENDING)
        syncs["column"] = self._count
        syncs["stamp"] = first + (last - first) * np.arange(1, cuts + 1) // (cuts + 1)
        inside = self._pending["stamp"][begin + 1 : end]
        places = begin + 1 + np.count_nonzero(inside < syncs["stamp"][:, None], axis=1)
        self._pending = np.insert(self._pending, places, syncs)

    def _empty(self) -> AlignedRows:
        shape = (0, self._count)
        return AlignedRows(
            np.empty(0, np.int64),
            np.empty(0, np.int64),
            np.empty(0, bool),
            np.empty((*shape, 8), np.uint8),
            np.empty(shape, bool),
            np.empty(shape, bool),
            np.empty(shape, bool),
        )
