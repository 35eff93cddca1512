"""One pass over the samples: columns of the model and of every candidate, filtered, decimated, reduced to
factors.

Idea 4 of the design. The rows of eq. (11) are formed block by block; a block of time of one session and one
joint becomes the triangular factor of [W  Y  tau]. Y is the measured torque less the known load; tau is the
measured torque itself, which the relative error refers to.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from identify.effects.model import Term
from identify.effects.motion import BlockMemory, JointMotion
from identify.estimation.record import Record, resting
from identify.estimation.triangular_factor import TriangularFactor
from identify.recording import SessionEntry
from identify.signals import MotionBlock

Array = NDArray[np.float64]

BLOCKS_PER_SESSION = 40
SHORTEST_BLOCK = 0.4
"""s. Blocks are the folds of cross-validation and the clusters of the robust deviations: many are wanted,
but each longer than what is left of a residual's memory after the filters."""


@dataclass(frozen=True)
class Slot:
    """A term with one choice of its constants: a group of columns."""

    term: Term
    constants: tuple[tuple[str, float], ...] = ()

    @classmethod
    def of(cls, term: Term, constants: dict[str, float] | None = None) -> "Slot":
        """The slot of a term; its own constants unless others are given."""
        chosen = dict(term.constants or ()) if constants is None else constants
        return cls(term, tuple(sorted(chosen.items())))

    @property
    def values(self) -> dict[str, float]:
        """The constants by name."""
        return dict(self.constants)


@dataclass(frozen=True)
class FittedTorque:
    """A fitted model as the columns of other effects need it: base parameters and the friction beside them.

    chi     : (b,) base parameters
    factors : for every slot the values of its parameters
    """

    chi: Array
    factors: tuple[tuple[Slot, Array], ...] = ()


@dataclass(frozen=True)
class TimeBlock:
    """A block of time of one session."""

    session: int
    """index among the observed sessions"""
    start: float
    stop: float


@dataclass
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

    @property
    def width(self) -> int:
        """Number of columns of W."""
        return self.base + sum(len(columns) for columns in self.slot_columns)

    def blocks_of(self, session: int) -> list[int]:
        """Indices of the blocks of a session."""
        return [index for index, block in enumerate(self.blocks) if block.session == session]

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


@dataclass
class JointContext:
    """What all effects of one block share."""

    block: MotionBlock
    entry: SessionEntry
    session: int
    session_start: float
    record_start: float
    inertial: list[Array]
    known: Array
    load: Array
    torque: Array
    memory: BlockMemory
    record: Record
    fitted: FittedTorque | None
    _views: dict[tuple[int, int], JointMotion] = field(default_factory=dict)

    def motion(self, joint: int, owner: int) -> JointMotion:
        """The block as an effect of motor or joint `owner` sees it on the rows of `joint`."""
        if (joint, owner) not in self._views:
            self._views[joint, owner] = self._view(joint, owner)
        return self._views[joint, owner]

    def _view(self, joint: int, owner: int) -> JointMotion:
        block, body = self.block, self.record.body
        chi = np.zeros(len(body.base)) if self.fitted is None else self.fitted.chi
        payload = self.entry.payload
        motor = body.shares[:, owner]
        session_time = block.time - self.session_start
        return JointMotion(
            joint=joint,
            time=block.time,
            session_time=session_time,
            experiment_time=session_time + self.record_start,
            q=block.q[:, joint],
            dq=block.dq[:, joint],
            ddq=block.ddq[:, joint],
            period=block.sampling_period,
            load=self.load[:, joint],
            model_torque=self.torque[:, joint],
            known_load=self.known[:, joint],
            payload=body.payload_index(payload),
            session=self.session,
            temperature=None if block.temperature is None else block.temperature[:, joint],
            motor_velocity=block.dq @ motor,
            motor_acceleration=block.ddq @ motor,
            motor_share=float(body.shares[joint, owner]),
            inertial=self.inertial[joint],
            memory=self.memory,
            load_slope_of=lambda: body.load_slope(joint, chi, payload, block.q, block.dq, block.ddq),
            gravity_gradient_of=lambda: body.gravity_gradient(joint, chi, payload, block.q),
            payload_gradient_of=lambda: body.payload_gradient(joint, payload, block.q, block.dq, block.ddq),
        )


def contexts(record: Record, entry: SessionEntry, fitted: FittedTorque | None) -> Iterator[JointContext]:
    """The blocks of a session with everything that columns are made of."""
    memory = BlockMemory()
    segment = -1
    session = [own.file for own in record.experiment.sessions].index(entry.file)
    start = float(record.session(entry).time[0])
    before = record.started(entry)
    for block in record.blocks(entry):
        if block.segment != segment:
            memory.forget()
            segment = block.segment
        known = record.body.known_load(entry.payload, block.q, block.dq, block.ddq, block.external)
        inertial = record.body.inertial_columns(block.q, block.dq, block.ddq)
        chi = np.zeros(len(record.body.base)) if fitted is None else fitted.chi
        load = known if fitted is None else record.body.load(inertial, chi, known)
        context = JointContext(
            block, entry, session, start, before, inertial, known, load, load, memory, record, fitted
        )
        if fitted is not None:
            context.torque = model_torque(context, fitted)
            context._views.clear()
        yield context


def model_torque(context: JointContext, fitted: FittedTorque) -> Array:
    """(N, n): load and friction as the fitted model predicts them, full rate."""
    torque = context.load.copy()
    for slot, values in fitted.factors:
        if not slot.term.effect.uses_torque:
            for joint, columns in slot_rows(context, slot):
                torque[:, joint] += columns @ values
    return torque


def slot_rows(context: JointContext, slot: Slot) -> Iterator[tuple[int, Array]]:
    """The rows that a slot has columns on: joint and columns (N, parameters)."""
    effect, owner = slot.term.effect, slot.term.joint
    for joint in rows_of(context.record, slot.term):
        yield joint, effect.columns(context.motion(joint, owner), slot.values)


def rows_of(record: Record, term: Term) -> list[int]:
    """Joints whose rows carry the columns of a term."""
    if term.effect.rows == "joint":
        return [term.joint]
    if term.effect.rows == "robot":
        return list(range(record.joints))
    return [int(joint) for joint in np.flatnonzero(record.body.shares[:, term.joint])]


def observe(
    record: Record,
    entries: Sequence[SessionEntry],
    slots: Sequence[Slot],
    fitted: FittedTorque | None = None,
) -> Observation:
    """Pass once over the samples of some sessions and reduce them to factors.

    fitted : the model that columns of load-dependent effects take the load from
    """
    writer = _Writer(record, list(entries), list(slots))
    for session, entry in enumerate(entries):
        edges = block_edges(record, entry)
        pending = _Pending(session, edges, record.joints)
        for context in contexts(record, entry, fitted):
            rows = writer.rows(context)
            moving = [
                ~context.block.at_decimated(
                    resting(
                        context.block.dq[:, joint], record.rest_speed[joint], context.block.sampling_period
                    )
                )
                for joint in range(record.joints)
            ]
            pending.add(context.block.decimated_time, rows, moving)
            writer.finish(pending.closed())
        writer.finish(pending.all())
    return writer.observation()


def block_edges(record: Record, entry: SessionEntry) -> Array:
    """Instants that cut a session into blocks of time."""
    time = record.session(entry).time
    duration = float(time[-1] - time[0])
    count = int(np.clip(duration / SHORTEST_BLOCK, 4, BLOCKS_PER_SESSION))
    return np.linspace(time[0], time[-1], count + 1)


class _Pending:
    """Decimated rows of the blocks of time that are still open."""

    def __init__(self, session: int, edges: Array, joints: int) -> None:
        self.session, self.edges, self.joints = session, edges, joints
        self.open: dict[int, list[list[Array]]] = {}

    def add(self, time: Array, rows: list[Array], moving: list[NDArray[np.bool_]]) -> None:
        place = np.clip(np.searchsorted(self.edges, time, side="right") - 1, 0, len(self.edges) - 2)
        for block in np.unique(place):
            parts = self.open.setdefault(int(block), [[] for _ in range(self.joints)])
            for joint in range(self.joints):
                parts[joint].append(rows[joint][(place == block) & moving[joint]])

    def closed(self) -> list[tuple[TimeBlock, list[TriangularFactor]]]:
        """Blocks that no later sample can fall into."""
        return [self._take(block) for block in sorted(self.open)[:-1]]

    def all(self) -> list[tuple[TimeBlock, list[TriangularFactor]]]:
        """Every block, the session being over."""
        return [self._take(block) for block in sorted(self.open)]

    def _take(self, block: int) -> tuple[TimeBlock, list[TriangularFactor]]:
        parts = self.open.pop(block)
        when = TimeBlock(self.session, float(self.edges[block]), float(self.edges[block + 1]))
        return when, [TriangularFactor.of(np.concatenate(part)) for part in parts]


class _Writer:
    """Forms the rows of every joint and keeps the table of columns."""

    def __init__(self, record: Record, entries: list[SessionEntry], slots: list[Slot]) -> None:
        self.record, self.entries, self.slots = record, entries, slots
        self.slot_columns: list[NDArray[np.intp]] | None = None
        self.joint_columns: list[NDArray[np.intp]] = []
        self.blocks: list[TimeBlock] = []
        self.factors: list[list[TriangularFactor]] = []

    def rows(self, context: JointContext) -> list[Array]:
        """For every joint its decimated rows [W Y tau]."""
        record, block = self.record, context.block
        torque = record.torque(block)
        parts: list[list[Array]] = [[columns] for columns in context.inertial]
        widths: list[int] = []
        where: list[list[int]] = [[] for _ in range(record.joints)]
        for index, slot in enumerate(self.slots):
            width = 0
            for joint, columns in slot_rows(context, slot):
                parts[joint].append(columns)
                where[joint].append(index)
                width = columns.shape[1]
            widths.append(width)
        if self.slot_columns is None:
            self._number(widths, where)
        found = []
        for joint in range(record.joints):
            measured = torque[:, joint : joint + 1]
            parts[joint] += [measured - context.known[:, joint : joint + 1], measured]
            found.append(block.decimate(np.hstack(parts[joint])))
        return found

    def _number(self, widths: list[int], where: list[list[int]]) -> None:
        base = len(self.record.body.base)
        starts = base + np.concatenate([[0], np.cumsum(widths)]).astype(int)
        self.slot_columns = [np.arange(starts[i], starts[i + 1]) for i in range(len(widths))]
        for joint, slots in enumerate(where):
            inertial = np.flatnonzero(self.record.body.base.acts[joint])
            self.joint_columns.append(
                np.concatenate([inertial, *(self.slot_columns[slot] for slot in slots)]).astype(np.intp)
            )

    def finish(self, blocks: list[tuple[TimeBlock, list[TriangularFactor]]]) -> None:
        for when, factors in blocks:
            self.blocks.append(when)
            self.factors.append(factors)

    def observation(self) -> Observation:
        return Observation(
            entries=self.entries,
            base=len(self.record.body.base),
            slots=self.slots,
            slot_columns=self.slot_columns or [],
            joint_columns=self.joint_columns,
            blocks=self.blocks,
            factors=self.factors,
        )
