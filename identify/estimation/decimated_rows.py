"""The rows of eq. (11) of a session, filtered and decimated: [W  Y  tau] of every joint, block by block.

Y is the measured torque less the known load; tau is the measured torque itself, which the relative error refers to.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from identify.estimation.context import FittedTorque, JointContext, Slot, contexts, rows_of
from identify.estimation.record import Record
from identify.estimation.reversal_noise import ReversalNoise, dry_friction
from identify.recording import SessionEntry
from identify.signals.parallel_filter import NUMBERS_AT_ONCE

Array = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class ColumnTable:
    """Which columns of W stand on the rows of which joint.

    slot_columns    : global column indices of each slot, behind the base parameters
    joint_columns   : for every joint the global indices of the columns on its rows
    slots_of_joints : for every joint the slots on its rows
    """

    base: int
    slot_columns: list[NDArray[np.intp]]
    joint_columns: list[NDArray[np.intp]]
    slots_of_joints: Sequence[Sequence[int]]

    @classmethod
    def of(
        cls, record: Record, widths: Sequence[int], slots_of_joints: Sequence[Sequence[int]]
    ) -> "ColumnTable":
        """Number the columns: widths of the slots, and for every joint the slots on its rows."""
        base = len(record.body.base)
        starts = base + np.concatenate([[0], np.cumsum(widths)]).astype(int)
        slot_columns = [np.arange(starts[i], starts[i + 1]) for i in range(len(widths))]
        joint_columns = [
            np.concatenate(
                [np.flatnonzero(record.body.base.acts[joint]), *(slot_columns[slot] for slot in slots)]
            ).astype(np.intp)
            for joint, slots in enumerate(slots_of_joints)
        ]
        return cls(base, slot_columns, joint_columns, slots_of_joints)

    @classmethod
    def merged(cls, record: Record, tables: Sequence["ColumnTable"]) -> "ColumnTable":
        """Of tables of the rows of some joints each, in which a slot that is on none of their rows has no columns."""
        widths = [
            max(len(table.slot_columns[i]) for table in tables) for i in range(len(tables[0].slot_columns))
        ]
        return cls.of(record, widths, tables[0].slots_of_joints)


@dataclass(frozen=True, eq=False)
class DecimatedRows:
    """Rows of one block of motion.

    time   : (M,) s
    rows   : for every joint (M, columns of the joint + 2): its columns of W, Y, tau
    moving : (M, joints) whether the sample takes part in the fit: a joint at rest does not
    """

    time: Array
    rows: list[Array]
    moving: NDArray[np.bool_]
    table: ColumnTable


def decimated_rows(
    record: Record,
    entry: SessionEntry,
    slots: Sequence[Slot],
    fitted: FittedTorque | None = None,
    reversals: ReversalNoise | None = None,
    joints: Sequence[int] | None = None,
) -> Iterator[DecimatedRows]:
    """Pass once over the samples of a session.

    fitted    : the model that columns of load-dependent effects take the load from
    reversals : weigh samples by what is not known of the instants of reversal; all samples alike if not given
    joints    : those whose rows are asked for; all of them if not given
    """
    samples = record.samples[entry.file]
    listed = list(range(record.joints) if joints is None else joints)
    columns = _Columns(record, entry, slots, listed)
    done = 0
    for number, context in enumerate(contexts(record, entry, fitted, columns.with_torque)):
        rows, table = columns.rows(number, context)
        if reversals is not None:
            dry = dry_friction(context, fitted)
            rows = [
                part * reversals.weights(context.block, joint, dry[:, joint])[:, None]
                for joint, part in zip(listed, rows, strict=True)
            ]
        count = context.block.count
        of_block = slice(done, done + count)
        yield DecimatedRows(samples.time[of_block], rows, samples.moving[of_block, listed], table)
        done += count
    columns.hold()


class _Columns:
    """The decimated columns of some slots over one pass of a session.

    Those that depend on the motion alone are taken from the record where it holds them, and given to it at the end of the
    pass: a search passes over the samples some ten times, and most of its candidates are such.
    """

    def __init__(
        self, record: Record, entry: SessionEntry, slots: Sequence[Slot], joints: Sequence[int]
    ) -> None:
        self._record, self._file, self._slots, self._joints = record, entry.file, slots, joints
        self._on_joint: list[list[int]] = [[] for _ in range(record.joints)]
        self._held: dict[tuple[int, int], list[Array]] = {}
        self._new: dict[tuple[int, int], list[Array]] = {}
        for index, slot in enumerate(slots):
            for joint in rows_of(record, slot.term):
                self._on_joint[joint].append(index)
                if slot.follows_fit or joint not in joints:
                    continue
                held = record.held_columns(entry.file, slot.name, joint)
                if held is None:
                    self._new[index, joint] = []
                else:
                    self._held[index, joint] = held
        self.with_torque = any(slot.term.effect.uses_torque for slot in slots)

    def rows(self, number: int, context: JointContext) -> tuple[list[Array], ColumnTable]:
        """For every joint that is asked for its rows [W Y tau] of the block with this number."""
        prepared, joints = context.prepared, self._record.joints
        rows, widths = [], [0] * len(self._slots)
        for joint in self._joints:
            indices = self._on_joint[joint]
            known = {i: self._held[i, joint][number] for i in indices if (i, joint) in self._held}
            known |= self._computed(context, joint, [index for index in indices if index not in known])
            for index in indices:
                widths[index] = known[index].shape[1]
                if (index, joint) in self._new:
                    self._new[index, joint].append(known[index].copy())
            effects = [known[index] for index in indices]
            measured = prepared.measured_rows[:, [joint, joints + joint]]
            rows.append(np.hstack([prepared.inertial_rows[joint], *effects, measured]))
        return rows, ColumnTable.of(self._record, widths, self._on_joint)

    def _computed(self, context: JointContext, joint: int, indices: Sequence[int]) -> dict[int, Array]:
        """The decimated columns of some slots on the rows of a joint.

        A few slots' columns at a time are computed and filtered, while the processor's cache holds them.
        """
        decimated: dict[int, Array] = {}
        waiting: dict[int, Array] = {}
        for index in indices:
            slot = self._slots[index]
            waiting[index] = context.columns(slot, joint)
            if index == indices[-1] or sum(columns.size for columns in waiting.values()) >= NUMBERS_AT_ONCE:
                filtered = context.block.decimate_tables(list(waiting.values()))
                ends = np.cumsum([columns.shape[1] for columns in waiting.values()])
                decimated |= zip(waiting, np.split(filtered, ends[:-1], axis=1), strict=True)
                waiting.clear()
        return decimated

    def hold(self) -> None:
        """Give the record what was computed for the first time."""
        for (index, joint), blocks in self._new.items():
            self._record.hold_columns(self._file, self._slots[index].name, joint, blocks)
