"""The rows of eq. (11) of a session, filtered and decimated: [W  Y  tau] of every joint, block by block.

Y is the measured torque less the known load; tau is the measured torque itself, which the relative error refers to.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from identify.estimation.context import FittedTorque, JointContext, Slot, contexts, slot_rows
from identify.estimation.record import Record
from identify.estimation.reversal_noise import ReversalNoise, dry_friction
from identify.recording import SessionEntry

Array = NDArray[np.float64]


@dataclass(frozen=True)
class ColumnTable:
    """Which columns of W stand on the rows of which joint.

    slot_columns  : global column indices of each slot, behind the base parameters
    joint_columns : for every joint the global indices of the columns on its rows
    """

    base: int
    slot_columns: list[NDArray[np.intp]]
    joint_columns: list[NDArray[np.intp]]

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
        return cls(base, slot_columns, joint_columns)


@dataclass(frozen=True)
class DecimatedRows:
    """Rows of one block of motion.

    time   : (M,) s
    rows   : for every joint (M, columns of the joint + 2): its columns of W, Y, tau
    moving : (M, n) whether the sample takes part in the fit: a joint at rest does not
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
) -> Iterator[DecimatedRows]:
    """Pass once over the samples of a session.

    fitted    : the model that columns of load-dependent effects take the load from
    reversals : weigh samples by what is not known of the instants of reversal; all samples alike if not given
    """
    samples = record.samples[entry.file]
    done = 0
    for context in contexts(record, entry, fitted):
        rows, table = block_rows(context, slots)
        if reversals is not None:
            dry = dry_friction(context, fitted)
            rows = [
                part * reversals.weights(context.block, joint, dry[:, joint])[:, None]
                for joint, part in enumerate(rows)
            ]
        count = context.block.count
        yield DecimatedRows(
            samples.time[done : done + count], rows, samples.moving[done : done + count], table
        )
        done += count


def block_rows(context: JointContext, slots: Sequence[Slot]) -> tuple[list[Array], ColumnTable]:
    """For every joint its decimated rows [W Y tau]."""
    record, prepared = context.record, context.prepared
    parts: list[list[Array]] = [[] for _ in range(record.joints)]
    slots_of_joints: list[list[int]] = [[] for _ in range(record.joints)]
    widths: list[int] = []
    for index, slot in enumerate(slots):
        width = 0
        for joint, columns in slot_rows(context, slot):
            parts[joint].append(columns)
            slots_of_joints[joint].append(index)
            width = columns.shape[1]
        widths.append(width)
    rows = []
    for joint, columns_of_effects in enumerate(parts):
        effects = [prepared.block.decimate(np.hstack(columns_of_effects))] if columns_of_effects else []
        measured = prepared.measured_rows[:, [joint, record.joints + joint]]
        rows.append(np.hstack([prepared.inertial_rows[joint], *effects, measured]))
    return rows, ColumnTable.of(record, widths, slots_of_joints)
