"""What the effects of one block of motion share, and the columns that they make of it."""

from collections.abc import Hashable, Iterator
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from identify.effects.model import Term
from identify.effects.motion import BlockMemory, JointMotion
from identify.estimation.motor_motion import GearSignals, gear_motion, pair_motion, rows_on
from identify.estimation.record import PreparedBlock, Record
from identify.recording import SessionEntry
from identify.signals import MotionBlock

Array = NDArray[np.float64]


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

    @property
    def follows_fit(self) -> bool:
        """Whether its columns depend on what was fitted; otherwise on the motion alone."""
        effect = self.term.effect
        return (effect.uses_load or effect.uses_torque) and not effect.known_beforehand

    @property
    def name(self) -> tuple[Hashable, ...]:
        """What tells it from other slots on one record."""
        effect = self.term.effect
        # formulas that are tried as descriptions share a name
        return type(effect), effect.name, effect.regressors, self.term.joint, self.constants


@dataclass(frozen=True, eq=False)
class FittedTorque:
    """A fitted model as the columns of other effects need it: base parameters and the friction beside them.

    chi     : (b,) base parameters
    factors : for every slot the values of its parameters
    """

    chi: Array
    factors: tuple[tuple[Slot, Array], ...] = ()

    def same_as(self, other: "FittedTorque | None") -> bool:
        """Whether the other is of the same effects with the same values."""
        return (
            other is not None
            and [slot for slot, _ in self.factors] == [slot for slot, _ in other.factors]
            and np.array_equal(self.chi, other.chi)
            and all(
                np.array_equal(values, theirs)
                for (_, values), (_, theirs) in zip(self.factors, other.factors, strict=True)
            )
        )

    def half_way_from(self, other: "FittedTorque") -> "FittedTorque":
        """The mean of both; of effects that the other does not have, or with other columns, the values of this one."""
        theirs = {slot.term.key: values for slot, values in other.factors}
        factors = []
        for slot, values in self.factors:
            before = theirs.get(slot.term.key, values)
            factors.append((slot, 0.5 * (values + before) if before.shape == values.shape else values))
        return FittedTorque(0.5 * (self.chi + other.chi), tuple(factors))

    def rotor(self, motor: int) -> float:
        """kg m²: inertia of a shared motor's rotor, where the model has it beside the base parameters; else 0."""
        return sum(
            float(values[slot.term.effect.rotor])
            for slot, values in self.factors
            if slot.term.joint == motor and slot.term.effect.rotor is not None
        )


@dataclass(eq=False)
class JointContext:
    """What all effects of one block share.

    session : index of the session among those of the experiment
    load    : (N, n) tau_out of the fitted model; without one the known load
    torque  : (N, n) the whole torque of the fitted model; without one the known load
    """

    prepared: PreparedBlock
    entry: SessionEntry
    session: int
    session_start: float
    record_start: float
    load: Array
    torque: Array
    memory: BlockMemory
    record: Record
    fitted: FittedTorque | None
    _views: dict[tuple[int, int], JointMotion] = field(default_factory=dict)
    _gears: dict[int, JointMotion] = field(default_factory=dict)

    @property
    def block(self) -> MotionBlock:
        """The block of motion."""
        return self.prepared.block

    @property
    def known(self) -> Array:
        """(N, n): known part of tau_out."""
        return self.prepared.known

    @property
    def inertial(self) -> list[Array]:
        """For each joint (N, base parameters that act on it): columns of eq. (10)."""
        return self.prepared.inertial

    def motion(self, joint: int, owner: int) -> JointMotion:
        """The block as an effect of motor or joint `owner` sees it on the rows of `joint`."""
        if (joint, owner) not in self._views:
            self._views[joint, owner] = self._view(joint, owner)
        return self._views[joint, owner]

    def columns(self, slot: Slot, joint: int) -> Array:
        """(N, parameters): the columns of a slot on the rows of a joint."""
        effect, owner = slot.term.effect, slot.term.joint
        if effect.rows == "pair":
            block, motion = self.block, self.motion(joint, joint)
            pair = pair_motion(self.record.body, owner, effect.beside, motion, block.dq, block.ddq)
            return effect.columns(pair, slot.values)
        if effect.rows != "gear" or not self.record.body.gears_apart[owner]:
            return effect.columns(self.motion(joint, owner), slot.values)
        return self.record.body.shares[joint, owner] * effect.columns(self.gear(owner), slot.values)

    def gear(self, motor: int) -> JointMotion:
        """The block as the gear of a motor sees it that shares axes with others: the motor's velocity and load."""
        if motor not in self._gears:
            block = self.block
            self._gears[motor] = gear_motion(
                self.record.body,
                self.motion(motor, motor),
                GearSignals(
                    block.q,
                    block.dq,
                    block.ddq,
                    block.direction,
                    self.load,
                    self.known,
                    self.inertial,
                    block.shared_direction,
                ),
                0.0 if self.fitted is None else self.fitted.rotor(motor),
            )
        return self._gears[motor]

    def forget(self) -> None:
        """Let go of what is known of the motions: they refer to this context, so that it would stay in memory with all of its
        signals until Python looks for such circles."""
        self._views.clear()
        self._gears.clear()

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
            direction=block.direction[:, joint],
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
            positions=block.q,
            inertial=self.inertial[joint],
            memory=self.memory,
            load_slope_of=lambda: self.prepared.load_slope(joint, chi),
            gravity_gradient_of=lambda: self.prepared.gravity_gradient(joint, chi),
            payload_gradient_of=lambda: body.payload_gradient(joint, payload, block.q, block.dq, block.ddq),
            payload_columns_of=lambda: body.payload_columns(joint, block.q, block.dq, block.ddq),
        )


def contexts(
    record: Record, entry: SessionEntry, fitted: FittedTorque | None, with_torque: bool = True
) -> Iterator[JointContext]:
    """The blocks of a session with everything that columns are made of.

    with_torque : whether an effect will look at the whole torque of the fitted model, friction included
    """
    memory = BlockMemory()
    segment = -1
    session = [declared.file for declared in record.experiment.sessions].index(entry.file)
    start, before = record.facts(entry).start, record.started(entry)
    for prepared in record.blocks(entry):
        if prepared.block.segment != segment:
            memory.forget()
            segment = prepared.block.segment
        load = prepared.known
        if fitted is not None:
            load = record.body.load(prepared.inertial, fitted.chi, prepared.known)
        context = JointContext(prepared, entry, session, start, before, load, load, memory, record, fitted)
        if fitted is not None and with_torque:
            context.torque = model_torque(context, fitted)
            context.forget()
        yield context
        context.forget()


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
    for joint in rows_of(context.record, slot.term):
        yield joint, context.columns(slot, joint)


def rows_of(record: Record, term: Term) -> list[int]:
    """Joints whose rows carry the columns of a term."""
    return rows_on(record.body, term)
