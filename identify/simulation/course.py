"""Windows of a record simulated side by side from given states, row by row."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from identify.simulation.controller import Controllers
from identify.simulation.dead_time import DeadTime, dead_times, parts_for
from identify.simulation.forward_dynamics import Integrator, RigidTransmissions
from identify.simulation.measured_motion import LARGEST_STEP, MeasuredMotion
from identify.simulation.torque_model import LINK, LINK_SPEED, StateKey, TorqueModel, Windows
from identify.simulation.two_masses import MOST_RADIANS, TwoMasses, oscillations

Array = NDArray[np.float64]
Rows = NDArray[np.intp]

STEPS_PER_RADIAN = 4
"""steps for each radian of the fastest oscillation of a joint on its presliding spring"""

STEPS_PER_RADIAN_OF_LINKS = 2
"""of the oscillation of a link on the spring of its gear, whose rule is implicit: its frequency is within 2 %"""

LARGEST_DECAY = 1.0
"""radians of the fastest loop, whose torque is held over a step, within it; beyond 2 it would grow"""

DIVERGED = 1.0
"""ranges of a joint's recorded positions; a simulation that is further off than this says nothing more"""


@dataclass(frozen=True)
class State:
    """What the motion of windows goes on from; (windows, joints), SI units.

    integral : of the position error that the controllers see; zero where there are none
    guess    : what the solution for the next accelerations starts from
    """

    windows: Windows
    integral: Array
    guess: Array


@dataclass(frozen=True)
class Trajectories:
    """Simulated motion: (samples, windows, joints), SI units, at the period of the record.

    starts  : (windows,) rows of the measured motion where the windows begin
    q       : and its derivatives: of the motors, where the encoders are
    applied : joint torque, N m or N
    memory  : by effect and joint (samples, windows)
    end     : the state at the last sample, from which the motion goes on
    """

    starts: Rows
    q: Array
    dq: Array
    ddq: Array
    direction: Array
    applied: Array
    memory: dict[StateKey, Array]
    end: State


class _RecordedTorque:
    """The torque of the record, straight from row to row, and a constant one beside it."""

    def __init__(self, model: TorqueModel, motion: MeasuredMotion, beside: Array | None) -> None:
        self._torque, self._beside = _effective_torque(model, motion), 0.0 if beside is None else beside

    def over(self, rows: tuple[Rows, Rows], part: int, parts: int, windows: Windows) -> tuple[Array, Array]:
        """Torque at the beginning and at the end of one of the parts between two rows."""
        first, last = (self._torque[row] + self._beside for row in rows)
        return first + (last - first) * (part / parts), first + (last - first) * ((part + 1) / parts)


class _ClosedLoop:
    """The torque of the controllers, held over each part of the way from row to row.

    lead     : part of a part, 0 or 0.5. 0 is the law as a drive computes it, sample by sample. Position and reference of its
               beginning lag by half a part, K/2 of whose length is taken from the damping: for a loop too stiff for it they
               are those of the part's middle, whereto the speed leads, and take nothing
    integral : (windows, joints), as it stands
    sent     : what was commanded and has not acted yet
    """

    def __init__(
        self,
        model: TorqueModel,
        motion: MeasuredMotion,
        controllers: Controllers,
        lead: float,
        sent: DeadTime,
    ) -> None:
        self._sent = sent
        self._controllers, self._motion, self._lead = controllers, motion, lead
        self._reference = controllers.reference(motion)
        self._gain = model.fitted.record.experiment.drive_gain
        self.integral = np.zeros(0)

    def over(self, rows: tuple[Rows, Rows], part: int, parts: int, windows: Windows) -> tuple[Array, Array]:
        """Torque at the beginning and at the end of one of the parts between two rows; the integral goes on."""
        period = self._motion.period / parts
        position, ahead = self._reference.between(*rows, (part + self._lead) / parts)
        error = self._controllers.error(position, windows.q + self._lead * period * windows.dq)
        integral = self.integral + self._lead * period * error
        command = self._controllers.command(error, integral, ahead, windows.dq)
        self.integral = self.integral + period * error
        torque = self._sent.acting(command @ self._gain.T)
        return torque, torque


def integral_that_gives_the_command(
    motion: MeasuredMotion, first: Rows, windows: Windows, controllers: Controllers
) -> Array:
    """(windows, joints): the integrals with which a loop gives the command that was recorded at some rows."""
    reference = controllers.reference(motion)
    error = controllers.error(reference.position[first], windows.q)
    return controllers.integral_for(motion.command[first], error, reference.ahead[first], windows.dq)


def simulate_from(
    model: TorqueModel,
    motion: MeasuredMotion,
    first: Rows,
    samples: int,
    state: State,
    controllers: Controllers | None = None,
    stop_when_lost: bool = False,
    beside: Array | None = None,
) -> Trajectories:
    """Simulate windows of `samples` samples from rows `first` of the measured motion on.

    controllers    : close the loop with these instead of the recorded torque
    stop_when_lost : end early once every window is further off than its joint's range of motion
    beside         : (windows, joints) N m or N, a torque beside the recorded one; none if not given
    Raises InputError: gains that no drive can have.
    """
    n = motion.q.shape[1]
    windows, guess = state.windows, state.guess
    parts, lead = _parts_of_sample(model, windows, motion.period, controllers)
    driven: _RecordedTorque | _ClosedLoop = _RecordedTorque(model, motion, beside)
    if controllers is not None:
        sent = DeadTime(model, motion, first, motion.period / parts, 0.5 - lead)
        driven = _ClosedLoop(model, motion, controllers, lead, sent)
        driven.integral = state.integral
    span = motion.span
    integrator: Integrator = RigidTransmissions(model, motion.period / parts)
    if model.gives:
        integrator = TwoMasses(model, windows, motion.period / parts, motion.period)
    course = {name: np.zeros((samples, len(first), n)) for name in ("q", "dq", "ddq", "direction", "applied")}
    memory = {key: np.zeros((samples, len(first))) for key in windows.memory}
    done = samples
    integral = state.integral
    for sample in range(samples):
        row = first + sample
        rows = (row, np.minimum(row + 1, len(motion) - 1))
        windows = replace(
            windows,
            external=None if motion.external is None else motion.external[row],
            temperature=None if motion.temperature is None else motion.temperature[row],
        )
        if isinstance(driven, _ClosedLoop):
            integral = driven.integral
        ends = driven.over(rows, 0, parts, windows)
        beginning = integrator.begin(windows, ends[0], guess)
        course["q"][sample], course["dq"][sample] = windows.q, windows.dq
        course["ddq"][sample], course["direction"][sample] = beginning.acceleration, beginning.direction
        course["applied"][sample] = ends[0]
        for key, held in windows.memory.items():
            memory[key][sample] = held
        if sample == samples - 1:
            break
        if stop_when_lost and np.all(lost(windows.q, motion.q[row], span)):
            done = sample + 1
            break
        for part in range(parts):
            if part:
                ends = driven.over(rows, part, parts, windows)
                beginning = integrator.begin(windows, ends[0], guess)
            windows, guess = integrator.step(windows, ends[1], beginning)
        # an unstable open loop may run away to where trigonometry of huge angles means nothing
        windows = _bounded(windows, motion.q[row] - 1e3 * span, motion.q[row] + 1e3 * span)
        guess = np.nan_to_num(guess)
    return Trajectories(
        first,
        *(course[name][:done] for name in ("q", "dq", "ddq", "direction", "applied")),
        memory={key: held[:done] for key, held in memory.items()},
        end=State(windows, integral, guess),
    )


def _bounded(windows: Windows, least: Array, most: Array) -> Windows:
    """The windows with positions within bounds (windows, joints), and speeds within what a number can hold."""
    memory = dict(windows.memory)
    for name, joint in windows.memory:
        held = np.nan_to_num(memory[name, joint])
        if name == LINK:
            memory[name, joint] = np.clip(held, least[:, joint], most[:, joint])
        elif name == LINK_SPEED:
            memory[name, joint] = np.clip(held, -1e6, 1e6)
    return replace(
        windows,
        q=np.clip(np.nan_to_num(windows.q), least, most),
        dq=np.clip(np.nan_to_num(windows.dq), -1e6, 1e6),
        memory=memory,
    )


def lost(q: Array, measured: Array, span: Array) -> NDArray[np.bool_]:
    """(windows,) whether a joint is further off than its range of motion."""
    return np.any(np.abs(q - measured) > DIVERGED * span, axis=-1)


def _effective_torque(model: TorqueModel, motion: MeasuredMotion) -> Array:
    """(N, n): the recorded torque at the instants when it acted."""
    torque = motion.torque.copy()
    for joint, lead in model.command_lead:
        torque[:, joint] = np.interp(motion.time + lead, motion.time, motion.torque[:, joint])
    return torque


def _parts_of_sample(
    model: TorqueModel, windows: Windows, period: float, controllers: Controllers | None
) -> tuple[int, float]:
    """Steps of integration for one sample of the record, and the lead of `_ClosedLoop`.

    Raises InputError: the loops of these controllers are faster than those of drives.
    """
    fastest = 1.0 / LARGEST_STEP
    if not model.stateful and not model.gives and controllers is None:
        return _whole(period * fastest), 0.0
    if model.gives:
        shown = [rate for rate in oscillations(model, windows).values() if rate * period <= MOST_RADIANS]
        fastest = max([fastest, *(STEPS_PER_RADIAN_OF_LINKS * rate for rate in shown)])
    _, slope = model.with_slope(windows, np.zeros(windows.q.shape))
    for slot in model.stateful:
        effect, joint = slot.term.effect, slot.term.joint
        stiffness = effect.stiffness_of_state(model.values_of(slot), slot.values)
        inertia = float(np.min(np.abs(slope[:, joint, joint])))
        if stiffness > 0 and inertia > 0:
            fastest = max(fastest, STEPS_PER_RADIAN * math.sqrt(stiffness / inertia))
    if controllers is None:
        return _whole(period * fastest), 0.0
    loops = controllers.opposing_rates(slope, model.fitted.record.experiment.drive_gain)
    parts = _whole(period * max(fastest, loops.fastest() / LARGEST_DECAY))
    parts = max(parts, parts_for(dead_times(model), period))
    return parts, 0.0 if loops.bears_holding(period / parts) else 0.5


def _whole(steps: float) -> int:
    return max(1, math.ceil(steps - 1e-9))
