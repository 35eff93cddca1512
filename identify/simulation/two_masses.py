"""Steps of motion where transmissions give: a motor and a link with a spring or a gap between them.

The encoder is on the motor, and so are the applied torque and friction, but for the dry friction F of a link. With theta of
the motors and q of the links, for a joint whose transmission gives, B its inertia on the motor's side and s what the gear
carries (Spong 1987):

    s = tau_out(q, q', q'') − B q'' + F sign(q'),   B theta'' = tau − friction(theta', tau_out) − s,   theta − q = twist(s)

tau_out is that of eq. (6), whose parameters hold both inertias of a joint. The other joints' rows are as ever.

The twist is taken over a step by one of two implicit rules, which are stable however stiff the spring is:

- An oscillation that the record's rows can show, less than a radian of it from row to row, is propagated: trapezoidal rule
  (Newmark 1959, β = 1/4), which keeps its energy.
- What is faster is driven by nothing that the record knows. The twist follows the load then (backward Euler), the mean of both
  masses moves as ever. A gap's flanks are always so: their stiffness has no bound.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from identify.simulation.driven_link import driven_link, link_lags
from identify.simulation.forward_dynamics import (
    Beginning,
    accelerations,
    correction,
    prediction,
)
from identify.simulation.link_friction import Transmission
from identify.simulation.measured_motion import MeasuredMotion
from identify.simulation.torque_model import (
    LINK,
    LINK_SPEED,
    StateKey,
    TorqueModel,
    Windows,
    slope_over_acceleration,
)

Array = NDArray[np.float64]
Rows = NDArray[np.intp]

MOST_RADIANS = 1.0
"""of an oscillation from row to row of the record, beyond which its rows do not show it"""

SETTLED = 1e-4
"""of the torque's size: what friction that follows the load is asked for again where the carried torque changed by more"""

HELD = 1e-9
"""of the speed that dry friction takes of a link in a step: a link that is slower is at rest up to rounding"""

MOST_ROUNDS = 4
MOST_SWEEPS = 30


class Links:
    """The links' equation of motion: joints that give are driven by what they carry, the others by their motors."""

    def __init__(self, model: TorqueModel) -> None:
        self._model = model
        self.joints = sorted(model.gives)
        self._rotors = np.array([model.gives[joint].rotor for joint in self.joints])
        self._all = len(self.joints) == model.joints
        self.linear = model.linear or self._all

    def torque(self, windows: Windows, acceleration: Array) -> Array:
        """(windows, joints) N m or N: what the gear carries where it gives, what the motor must give elsewhere."""
        if self._all:
            torque = load = self._model.load(windows, acceleration)
        else:
            torque, load = self._model.torque_and_load(windows, acceleration)
        torque[:, self.joints] = load[:, self.joints] - self._rotors * acceleration[:, self.joints]
        return torque

    def with_slope(self, windows: Windows, acceleration: Array) -> tuple[Array, Array]:
        """The torque and its derivative over the links' accelerations."""
        return slope_over_acceleration(self.torque, windows, acceleration)

    def mobility(self, windows: Windows, acceleration: Array, stuck: NDArray[np.bool_]) -> Array:
        """(windows, joints, joints): links' accelerations per torque, `stuck` joints held."""
        _, slope = self.with_slope(windows, acceleration)
        slope = np.where(stuck[:, :, None] | stuck[:, None, :], 0.0, slope)
        slope += np.where(stuck, 1.0, 0.0)[:, :, None] * np.eye(stuck.shape[1])
        inverse = np.linalg.inv(slope)
        return np.where(stuck[:, :, None] | stuck[:, None, :], 0.0, inverse)


@dataclass(frozen=True)
class _Rule:
    """The twist at the end of a rule's step: anchor + weight · (theta'' − q''); (windows, giving joints) and (giving joints,).

    going : (windows, giving joints) the links' speeds as the step begins
    speed : at its end with q'' = 0; `late` s · q'' more
    """

    anchor: Array
    weight: Array
    going: Array
    speed: Array
    late: float


@dataclass(frozen=True)
class _Solution:
    """Accelerations of motors and links (windows, joints), directions of the motors, what drives the links (windows, giving
    joints): what is carried less their dry friction."""

    motor: Array
    link: Array
    direction: Array
    driving: Array
    mobility: Array

    @property
    def guess(self) -> Array:
        return np.hstack([self.link, self.driving])


@dataclass(frozen=True)
class _BeginningOfTwo(Beginning):
    solution: _Solution


class TwoMasses:
    """Steps of `period` s of a model whose transmissions give (`forward_dynamics.Integrator`).

    row : s between the rows of the record
    """

    def __init__(self, model: TorqueModel, windows: Windows, period: float, row: float) -> None:
        self._model, self._period = model, period
        self._links = Links(model)
        self._joints = self._links.joints
        self._gives = [model.gives[joint] for joint in self._joints]
        self._rotors = np.array([give.rotor for give in self._gives])
        rates = oscillations(model, windows)
        self._rubbing = np.array([give.link_dry for give in self._gives])
        self._relaxations = np.array([give.relaxation for give in self._gives])
        self._shown = np.array(
            [joint in rates and rates[joint] * row <= MOST_RADIANS for joint in self._joints]
        )

    def begin(self, windows: Windows, applied: Array, guess: Array) -> _BeginningOfTwo:
        """The accelerations at the beginning of a step; guess (windows, joints + giving joints)."""
        twist, rate = self._twist(windows)
        h, relaxation = self._period, self._relaxations
        anchor = np.where(self._shown, twist, twist + h * rate) + relaxation * rate
        speed = self._link(windows)[1]
        rule = _Rule(anchor, np.where(self._shown, 0.0, h * (h + relaxation)), speed, speed, h)
        solution = self._solved(windows, applied, guess, rule)
        return _BeginningOfTwo(solution.motor, solution.direction, solution.guess, solution)

    def step(self, windows: Windows, applied: Array, beginning: Beginning) -> tuple[Windows, Array]:
        """The windows one step later and a guess of what comes then."""
        assert isinstance(beginning, _BeginningOfTwo)
        first, h, shown, joints = beginning.solution, self._period, self._shown, self._joints
        predicted = prediction(self._model, windows, h, first.motor, first.direction)
        link, speed = self._link(windows)
        link_first = first.link[:, joints]
        memory = {
            **predicted.middle.memory,
            **self._memory(link + h * speed + 0.5 * h**2 * link_first, speed + h * link_first),
        }
        middle = replace(predicted.middle, memory=memory)
        stops = predicted.stops[:, joints]
        part = np.where(shown, 0.25 * h**2, 0.0)
        reached = windows.q + h * windows.dq
        ahead = np.where(stops, middle.q[:, joints], reached[:, joints] + part * first.motor[:, joints])
        late = np.where(shown, 0.5 * h, 0.0)
        going = np.where(stops, 0.0, windows.dq[:, joints] + late * first.motor[:, joints])
        rate = going - (speed + late * link_first)
        rule = _Rule(
            ahead - (link + h * speed + part * link_first) + self._relaxations * rate,
            np.where(shown, 0.25, 1.0) * h**2 + self._relaxations * np.where(shown, 0.5, 1.0) * h,
            speed,
            speed + 0.5 * h * link_first,
            0.5 * h,
        )
        second = self._solved(middle, applied, first.guess, rule, first.mobility)
        ended = correction(
            self._model,
            windows,
            h,
            replace(predicted, middle=middle),
            (first.motor, second.motor),
            first.direction,
        )
        # mean acceleration of the motors and of the twist over the step
        motor = 0.5 * (first.motor + second.motor)[:, joints]
        links = 0.5 * (link_first + second.link[:, joints])
        twisting = motor - links
        moved = reached[:, joints] + 0.5 * h**2 * motor
        # what follows gives way by the whole of its step; the mean of both masses does not, nor a link that friction holds
        mobile = np.diagonal(first.mobility[:, joints][:, :, joints], axis1=1, axis2=2)
        speed_after = speed + h * links
        slowed = h * self._rubbing * mobile
        held = np.abs(speed_after) < HELD * slowed
        share = 1.0 / (1.0 + self._rotors * np.where(held, 0.0, mobile))
        moved = np.where(shown, moved, moved + share * 0.5 * h**2 * twisting)
        q = ended.q.copy()
        q[:, joints] = np.where(stops, q[:, joints], moved)
        twist, rate = self._twist(windows)
        linked = np.where(
            shown, link + h * speed + 0.5 * h**2 * links, moved - (twist + h * rate + h**2 * twisting)
        )
        linked = np.where(stops & ~shown, link + h * speed_after, linked)
        memory = {**ended.memory, **self._memory(linked, speed_after)}
        return replace(ended, q=q, memory=memory), second.guess

    def _link(self, windows: Windows) -> tuple[Array, Array]:
        """(windows, giving joints) positions and speeds of the links that give."""
        position = np.stack([windows.memory[LINK, joint] for joint in self._joints], axis=1)
        return position, np.stack([windows.memory[LINK_SPEED, joint] for joint in self._joints], axis=1)

    def _twist(self, windows: Windows) -> tuple[Array, Array]:
        """(windows, giving joints) how far, and how fast, the motors go ahead of their links."""
        link, speed = self._link(windows)
        return windows.q[:, self._joints] - link, windows.dq[:, self._joints] - speed

    def _memory(self, link: Array, speed: Array) -> dict[StateKey, Array]:
        states: dict[StateKey, Array] = {}
        for number, joint in enumerate(self._joints):
            states[LINK, joint], states[LINK_SPEED, joint] = link[:, number], speed[:, number]
        return states

    def _solved(
        self, windows: Windows, applied: Array, guess: Array, rule: _Rule, mobility: Array | None = None
    ) -> _Solution:
        """Accelerations and what drives the links under an applied torque, with the twist of a rule."""
        n, joints = windows.q.shape[1], self._joints
        link, driving = guess[:, :n], guess[:, n:]
        size = SETTLED * max(1e-12, float(np.max(np.abs(applied), initial=0.0)))
        resting = windows.dq[:, joints] == 0.0
        for last in range(MOST_ROUNDS - 1, -1, -1):
            torque = applied.copy()
            torque[:, joints] = driving
            link, direction = accelerations(self._links, windows, torque, link, free=joints)
            if mobility is None:
                stuck = (windows.dq == 0.0) & (direction == 0.0)
                stuck[:, joints] = False
                mobility = self._links.mobility(windows, link, stuck)
            least, most = self._friction(windows, link, direction, resting)
            motors = applied[:, joints], least, most, resting
            carried, friction = self._carried(
                rule, driving, link[:, joints], mobility[:, joints][:, :, joints], motors
            )
            change = carried - friction - driving
            link = link + (mobility[:, :, joints] @ change[:, :, None])[:, :, 0]
            driving = carried - friction
            if not last or np.max(np.abs(change), initial=0.0) <= size:
                motor, ways = link.copy(), direction.copy()
                motor[:, joints], moving = self._motors(applied[:, joints] - carried, least, most, resting)
                ways[:, joints] = np.where(
                    resting, np.where(moving, np.sign(motor[:, joints]), 0.0), direction[:, joints]
                )
                return _Solution(motor, link, ways, driving, mobility)
        raise AssertionError("the last round returns")

    def _friction(
        self, windows: Windows, link: Array, direction: Array, resting: NDArray[np.bool_]
    ) -> tuple[Array, Array]:
        """(windows, giving joints) least and most that the motors lose; the same where they move."""
        joints, either_way = self._joints, []
        for way in (1.0, -1.0) if resting.any() else (1.0,):
            tried = direction.copy()
            tried[:, joints] = np.where(resting, way, direction[:, joints])
            torque, load = self._model.torque_and_load(replace(windows, direction=tried), link)
            either_way.append((torque - load)[:, joints])
        return np.minimum(either_way[0], either_way[-1]), np.maximum(either_way[0], either_way[-1])

    def _motors(
        self, pushed: Array, least: Array, most: Array, resting: NDArray[np.bool_]
    ) -> tuple[Array, NDArray[np.bool_]]:
        """Accelerations of the motors under what their links leave of the torque, and whether they move."""
        lost = np.where(resting, np.clip(pushed, least, most), most)
        return (pushed - lost) / self._rotors, ~resting | (pushed != lost)

    def _carried(
        self,
        rule: _Rule,
        driving: Array,
        link: Array,
        mobility: Array,
        motors: tuple[Array, Array, Array, NDArray[np.bool_]],
    ) -> tuple[Array, Array]:
        """(windows, giving joints) each: carried torques with which the twist of the rule is that of the transmission, and the
        links' dry friction.

        link : the links' accelerations where `driving` drives them; they change with it by `mobility`
        """
        applied, least, most, resting = motors
        carried, friction = driving.copy(), np.zeros(driving.shape)
        for _ in range(MOST_SWEEPS):
            change = 0.0
            for number, give in enumerate(self._gives):
                mobile = mobility[:, number, number]
                further = carried - friction - driving
                further[:, number] = -driving[:, number]
                alone = link[:, number] + np.einsum("wk,wk->w", mobility[:, number], further)
                motor, moving = self._motors(applied - carried, least, most, resting)
                transmission = Transmission(
                    give,
                    rule.anchor[:, number] + rule.weight[number] * (motor[:, number] - alone),
                    rule.weight[number] * np.where(moving[:, number], 1.0 / give.rotor, 0.0),
                    rule.weight[number] * mobile,
                    carried[:, number],
                )
                if give.link_dry:
                    new, friction[:, number] = transmission.with_friction(
                        rule.going[:, number], rule.speed[:, number] + rule.late * alone, rule.late * mobile
                    )
                else:
                    new = transmission.carried(0.0)
                change = max(change, float(np.max(np.abs(new - carried[:, number]), initial=0.0)))
                carried[:, number] = new
            if change <= 1e-12 * (1.0 + float(np.max(np.abs(carried), initial=0.0))):
                break
        return carried, friction


def oscillations(model: TorqueModel, windows: Windows) -> dict[int, float]:
    """rad/s, by joint: the fastest oscillation of motor against link; of joints that have a spring alone."""
    links = Links(model)
    stuck = np.zeros(windows.q.shape, bool)
    mobility = links.mobility(windows, np.zeros(windows.q.shape), stuck)
    return {
        joint: float(np.sqrt(np.max(mobility[:, joint, joint] + 1.0 / give.rotor) / give.compliance))
        for joint, give in model.gives.items()
        if not give.gap
    }


def measured_links(
    model: TorqueModel, motion: MeasuredMotion, first: Rows
) -> tuple[dict[StateKey, Array], Array]:
    """Where the links stand at some rows, and what drives them: links that the measured motion of their motors has driven until
    then."""

    def loads(q: Array, ddq: Array) -> Array:
        """(N, joints) N m or N, links and motors together."""
        memory: dict[StateKey, Array] = {}
        for joint in model.gives:
            memory[LINK, joint], memory[LINK_SPEED, joint] = q[:, joint], motion.dq[:, joint]
        direction = np.sign(motion.direction)
        windows = Windows(motion.time, q, motion.dq, direction, motion.external, memory=memory)
        return model.load(windows, ddq)

    states: dict[StateKey, Array] = {}
    driving = []
    later = np.maximum(first, 1)
    for joint in sorted(model.gives):
        link = driven_link(joint, motion.period, (motion.q, motion.dq, motion.ddq), loads)
        (lag,) = link_lags(model.gives[joint], [link])
        rate = (lag.twist[later] - lag.twist[later - 1]) / motion.period
        states[LINK, joint] = motion.q[first, joint] - lag.twist[first]
        states[LINK_SPEED, joint] = (
            np.where(motion.resting[first, joint], 0.0, motion.dq[first, joint]) - rate
        )
        driving.append(lag.carried[first] - lag.friction[first])
    return states, np.stack(driving, axis=1)
