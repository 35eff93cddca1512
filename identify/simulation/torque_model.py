"""The torque of a fitted model as a function of the state: eq. (6) for many windows of motion at once.

The identifier forms columns along time; a simulation needs the same columns at one instant of many windows. Rows
of a block of motion are independent of each other for every effect that depends on the instant alone, so a block whose
rows are the windows gives them with the identifier's own code. Effects with a memory bring a state of their own.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field, replace

import numpy as np
from numpy.typing import NDArray

from identify.dynamics.inverse_dynamics import InverseDynamics
from identify.dynamics.payload import payload_parameters
from identify.dynamics.standard_parameters import PARAMETERS_PER_JOINT
from identify.effects.load_velocity import LoadVelocity
from identify.effects.motion import BlockMemory
from identify.estimation.context import FittedTorque, JointContext, Slot, rows_of
from identify.estimation.fitted_model import FittedModel
from identify.estimation.record import PreparedBlock
from identify.recording import SessionEntry
from identify.signals import MotionBlock
from identify.simulation.driven_link import SLOPE_STEP
from identify.simulation.give_fit import GiveFit, formed_as, give_fit

Array = NDArray[np.float64]
StateKey = tuple[str, int]
"""name of the effect, joint"""

LINK, LINK_SPEED = "link", "link's speed"
"""names of the states of a joint whose transmission gives: where its link stands, and its speed"""

STILL = 1e-12
"""rad/s or m/s. A joint about to move from rest is given this velocity in the direction tried, so that formulas with
sign(dq) agree with those that use the direction."""


@dataclass(frozen=True)
class Windows:
    """The state of many windows at one instant each; (windows, joints), SI units.

    direction : -1, 0 or 1: the way that dry friction opposes
    memory    : by effect and joint the state of its memory, (windows,)
    """

    time: Array
    q: Array
    dq: Array
    direction: Array
    external: Array | None = None
    temperature: Array | None = None
    memory: Mapping[StateKey, Array] = field(default_factory=dict)

    def repeated(self, times: int) -> Windows:
        """The same windows several times over, one copy behind the other."""
        return Windows(
            np.tile(self.time, times),
            np.tile(self.q, (times, 1)),
            np.tile(self.dq, (times, 1)),
            np.tile(self.direction, (times, 1)),
            None if self.external is None else np.tile(self.external, (times, 1)),
            None if self.temperature is None else np.tile(self.temperature, (times, 1)),
            {key: np.tile(state, times) for key, state in self.memory.items()},
        )


class TorqueModel:
    """A fitted model in one session: torque and its derivative over the acceleration.

    fitted : the model with its parameters
    entry  : the session, whose payload is carried
    given  : how its transmissions give, and the parameters beside that; `give_fit` of the model if not said
    """

    def __init__(self, fitted: FittedModel, entry: SessionEntry, given: GiveFit | None = None) -> None:
        given = given or give_fit(fitted)
        fitted = given.fitted
        self.fitted, self.entry = fitted, entry
        record = fitted.record
        self.joints = record.joints
        self._session = [session.file for session in record.experiment.sessions].index(entry.file)
        self._start = record.facts(entry).start
        self._before = record.started(entry)
        self._period = record.facts(entry).period
        base = record.body.base
        self._chi = fitted.fit.chi[: len(base)]
        # friction that follows the load follows the load of this model, not that of the fit before it
        self._load_from = fitted.torque if np.any(self._chi) else fitted.load_from
        load_from = self._load_from
        payload = np.zeros(PARAMETERS_PER_JOINT * record.joints)
        payload[-PARAMETERS_PER_JOINT:-1] = payload_parameters(entry.payload)
        self._loaded = bool(payload.any())
        of_load = self._chi if load_from is None else load_from.chi
        # the robot as fitted, as the load of other effects was, and what it carries
        sets = [base.nearest_standard(self._chi) + payload, base.nearest_standard(of_load) + payload]
        self._rigid = InverseDynamics(base.geometry, [*sets, payload] if self._loaded else sets)
        values = [
            (slot, fitted.fit.chi[columns])
            for slot, columns in zip(fitted.slots, fitted.observation.slot_columns, strict=True)
        ]
        inertias = [0.0] * record.joints
        if load_from is not None and any(slot.term.effect.from_derivatives for slot, _ in values):
            inertias = record.own_inertias(fitted.entries, load_from.chi)
        self._slots = [
            (s, s.term.effect.simulated_values(v, s.values, inertias[s.term.joint]))
            for s, v in values
            if formed_as(s, given.gives) not in ("command", "give")
        ]
        self.stateful = [s for s, _ in self._slots if s.term.effect.simulated_with(s.values) == "state"]
        self.meets = any("play" in slot.values for slot in self.stateful)
        """whether links are met by their motors across a gap"""
        self.gives = dict(given.gives)
        """by joint: how its transmission gives between the motor, where the encoder is, and the link"""
        self.command_lead = [
            (slot.term.joint, slot.term.effect.command_lead(constants))
            for slot, constants in values
            if slot.term.effect.simulated_with(slot.values) == "command"
        ]
        """(joint, s): how much later than the motion the recorded command stands"""
        effects = [slot.term.effect for slot, _ in self._slots]
        self._wants_columns = any(isinstance(effect, LoadVelocity) for effect in effects)
        self._wants_torque = any(effect.uses_torque for effect in effects)
        self.linear = not any(
            effect.uses_load or effect.uses_torque or effect.nonlinear for effect in effects
        )
        """whether the torque is linear in the acceleration"""

    def torque(self, windows: Windows, acceleration: Array) -> Array:
        """(windows, joints) N m or N: what the motors must give for this state and acceleration."""
        return self.torque_and_load(windows, acceleration)[0]

    def torque_and_load(self, windows: Windows, acceleration: Array) -> tuple[Array, Array]:
        """(windows, joints) N m or N each: what the motors must give, and what of it the robot's bodies take.

        acceleration : of the links
        """
        torque, load, known = self._rigid_parts(windows, acceleration)
        context = self._context(windows, acceleration, load, known)
        for slot, values in self._slots:
            for joint in rows_of(self.fitted.record, slot.term):
                torque[:, joint] += self._slot_torque(context, slot, values, joint, windows)
        return torque, load

    def load(self, windows: Windows, acceleration: Array) -> Array:
        """(windows, joints) N m or N: tau_out as effects that follow the load see it."""
        return self._rigid_parts(windows, acceleration)[1]

    def with_slope(self, windows: Windows, acceleration: Array) -> tuple[Array, Array]:
        """`slope_over_acceleration` of the torque: the inertia as it is felt."""
        return slope_over_acceleration(self.torque, windows, acceleration)

    def values_of(self, slot: Slot) -> Array:
        """(parameters,) fitted values of an effect."""
        return next(values for candidate, values in self._slots if candidate is slot)

    def rigid_torque(self, windows: Windows, acceleration: Array) -> Array:
        """(windows, joints): tau_out of eq. (6) alone, base parameters and declared payload."""
        return self._rigid_parts(windows, acceleration)[0]

    def started(self, windows: Windows) -> dict[StateKey, Array]:
        """States of the effects with a memory where nothing is known of what was before."""
        return {
            (slot.term.effect.name, slot.term.joint): slot.term.effect.state_at_start(
                windows.direction[:, slot.term.joint]
            )
            for slot in self.stateful
        }

    def advanced(
        self, memory: Mapping[StateKey, Array], before: Array, after: Array
    ) -> dict[StateKey, Array]:
        """States after the joints have moved from positions `before` to `after`, (windows, joints)."""
        moved = dict(memory)
        for slot in self.stateful:
            key, joint = (slot.term.effect.name, slot.term.joint), slot.term.joint
            travel = after[:, joint] - before[:, joint]
            moved[key] = slot.term.effect.state_after(memory[key], travel, slot.values)
        return moved

    def link_motion(self, windows: Windows) -> tuple[Array, Array]:
        """(windows, joints) positions and speeds of the links: those of the motors but where the transmission gives."""
        if not self.gives:
            return windows.q, windows.dq
        q, dq = windows.q.copy(), windows.dq.copy()
        for joint in self.gives:
            q[:, joint], dq[:, joint] = windows.memory[LINK, joint], windows.memory[LINK_SPEED, joint]
        return q, dq

    def struck(self, before: Windows, after: Windows) -> Windows:
        """The windows after links have been met by their motors across a gap: their momentum is shared at once."""
        inertias = np.zeros(after.q.shape)
        for slot in self.stateful:
            key, joint = (slot.term.effect.name, slot.term.joint), slot.term.joint
            inertias[:, joint] += slot.term.effect.impact(
                before.memory[key], after.memory[key], self.values_of(slot), slot.values
            )
        if not inertias.any():
            return after
        _, slope = self.with_slope(after, np.zeros(after.q.shape))
        lost = np.linalg.solve(slope, (inertias * after.dq)[:, :, None])[:, :, 0]
        met = np.any(inertias != 0.0, axis=1, keepdims=True)
        return replace(after, dq=np.where(met, after.dq - lost, after.dq))

    def _slot_torque(
        self, context: JointContext, slot: Slot, values: Array, joint: int, windows: Windows
    ) -> Array:
        return self._columns(context, slot, joint, windows) @ values

    def _columns(self, context: JointContext, slot: Slot, joint: int, windows: Windows) -> Array:
        effect, owner = slot.term.effect, slot.term.joint
        if effect.simulated_with(slot.values) == "state":
            motion = context.motion(joint, owner)
            return effect.columns_of_state(motion, windows.memory[effect.name, owner], slot.values)
        return context.columns(slot, joint)

    def _rigid_parts(self, windows: Windows, acceleration: Array) -> tuple[Array, Array, Array]:
        """tau_out of eq. (6), the load that other effects follow, and the known part of both, (windows, joints) each."""
        torque, load, *carried = self._rigid.torques(*self.link_motion(windows), acceleration)
        known = carried[0] if carried else np.zeros(torque.shape)
        if windows.external is not None:
            torque, load, known = (part - windows.external for part in (torque, load, known))
        return torque, known if self._load_from is None else load, known

    def _context(self, windows: Windows, acceleration: Array, load: Array, known: Array) -> JointContext:
        record, load_from = self.fitted.record, self._load_from
        prepared = PreparedBlock(
            _block(windows, acceleration, self._period),
            record.body,
            self.entry,
            record.experiment.drive_gain,
        )
        vars(prepared)["known"] = known
        if load_from is not None:
            vars(prepared)["load_slope"] = lambda joint, _: self._load_slope(
                windows, acceleration, load, joint
            )
        if self._wants_columns and self.gives:
            q, dq = self.link_motion(windows)
            links = replace(windows, q=q, dq=dq)
            of_links = PreparedBlock(
                _block(links, acceleration, self._period),
                record.body,
                self.entry,
                record.experiment.drive_gain,
            )
            vars(prepared)["inertial"] = of_links.inertial
        if not self._wants_columns:  # nobody looks at the regressor, which would cost most of the time
            vars(prepared)["inertial"] = [
                np.zeros((len(load), int(acts.sum()))) for acts in record.body.base.acts
            ]
        context = JointContext(
            prepared,
            self.entry,
            self._session,
            self._start,
            self._before,
            load,
            load,
            BlockMemory(),
            record,
            load_from,
        )
        if load_from is not None and self._wants_torque:
            context.torque = self._whole_torque(context, load_from, windows)
            context._views.clear()
            context._gears.clear()
        return context

    def _load_slope(self, windows: Windows, acceleration: Array, load: Array, joint: int) -> Array:
        """(windows,) N m/rad or N/m: derivative of a joint's load over its own position."""
        q, dq = self.link_motion(windows)
        moved = q.copy()
        moved[:, joint] += SLOPE_STEP
        sets = self._rigid.torques(moved, dq, acceleration)
        further = sets[1][:, joint]
        if windows.external is not None:
            further = further - windows.external[:, joint]
        return (further - load[:, joint]) / SLOPE_STEP

    def _whole_torque(self, context: JointContext, load_from: FittedTorque, windows: Windows) -> Array:
        """(windows, joints): load and friction that columns in proportion to the torque are made of."""
        torque = context.load.copy()
        for slot, values in load_from.factors:
            effect = slot.term.effect
            if effect.uses_torque or formed_as(slot, self.gives) in ("command", "give"):
                continue
            for joint in rows_of(context.record, slot.term):
                torque[:, joint] += self._slot_torque(context, slot, values, joint, windows)
        return torque


def slope_over_acceleration(
    torque: Callable[[Windows, Array], Array], windows: Windows, acceleration: Array, step: float = 1e-2
) -> tuple[Array, Array]:
    """A torque (windows, n) and its derivative over the acceleration (windows, n, n).

    step : rad/s² or m/s² of the difference quotient; exact up to rounding where the torque is linear, and
           within one quadrant of Fig. 2 where friction follows the load
    """
    count, n = windows.q.shape
    tried = np.tile(acceleration, (n + 1, 1))
    for joint in range(n):
        tried[(joint + 1) * count : (joint + 2) * count, joint] += step
    stacked = torque(windows.repeated(n + 1), tried).reshape(n + 1, count, n)
    return stacked[0], ((stacked[1:] - stacked[0]) / step).transpose(1, 2, 0)


def _block(windows: Windows, acceleration: Array, period: float) -> MotionBlock:
    """A block of motion whose rows are the windows."""
    dq = np.where(windows.dq == 0.0, STILL * windows.direction, windows.dq)
    return MotionBlock(
        segment=0,
        rows=slice(0, len(dq)),
        time=windows.time,
        position=windows.q,
        q=windows.q,
        dq=dq,
        ddq=acceleration,
        direction=windows.direction,
        reversals=(),
        command=np.zeros(dq.shape),
        external=windows.external,
        temperature=windows.temperature,
        first=0,
        count=len(dq),
        factor=1,
        cutoff=0.5 / period,
        sampling_period=period,
    )
