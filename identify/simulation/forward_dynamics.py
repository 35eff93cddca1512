"""One step of motion: the acceleration that a torque makes, with stick and slip, and its integral.

Dry friction leaves the acceleration undefined at rest: a joint at rest stays there while the torque that friction must
make is below the breakaway torque in that direction (the stiction area of eq. 26), else it slides the way that the torque
pushes (Karnopp 1985). A joint that stops within a step is brought to rest at that instant and asked anew.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from identify.simulation.torque_model import TorqueModel, Windows

Array = NDArray[np.float64]
Mask = NDArray[np.bool_]

LEAST_INERTIA = 1e-10
"""Part of the largest inertia of a robot's joints that one has: below is the rounding of the difference quotients it comes of."""
SETTLED = 1e-9
"""part of the torque's size below which what is left of the equation of motion counts as solved"""
MOST_ITERATIONS = 8
"""Newton steps; friction that follows the load is linear within a quadrant of Fig. 2, so that two or three do"""
MOST_HALVINGS = 20
"""of the way between two iterates that Newton's method goes to and fro between"""


class Dynamics(Protocol):
    """What an equation of motion is solved for: a torque as a function of state and acceleration."""

    linear: bool
    """whether the torque is linear in the acceleration"""

    def torque(self, windows: Windows, acceleration: Array) -> Array:
        """(windows, joints) N m or N."""
        ...

    def with_slope(self, windows: Windows, acceleration: Array) -> tuple[Array, Array]:
        """The torque and its derivative over the acceleration (windows, joints, joints)."""
        ...


@dataclass(frozen=True)
class Beginning:
    """What a step begins with; (windows, joints).

    acceleration : of the motors, rad/s² or m/s²; 0 where one sticks
    direction    : -1, 0, 1: the way that dry friction opposes
    guess        : what the next solution starts from
    """

    acceleration: Array
    direction: Array
    guess: Array


class Integrator(Protocol):
    """Steps of one length for many windows."""

    def begin(self, windows: Windows, applied: Array, guess: Array) -> Beginning:
        """The accelerations under a torque applied at the beginning of a step."""
        ...

    def step(self, windows: Windows, applied: Array, beginning: Beginning) -> tuple[Windows, Array]:
        """The windows one step later under a torque applied at its end, and a guess of what comes next."""
        ...


@dataclass(frozen=True)
class RigidTransmissions:
    """Steps of `period` s where links and motors move together."""

    model: TorqueModel
    period: float

    def begin(self, windows: Windows, applied: Array, guess: Array) -> Beginning:
        """The accelerations under a torque applied at the beginning of a step."""
        acceleration, direction = accelerations(self.model, windows, applied, guess)
        return Beginning(acceleration, direction, acceleration)

    def step(self, windows: Windows, applied: Array, beginning: Beginning) -> tuple[Windows, Array]:
        """The windows one step later under a torque applied at its end, and a guess of what comes next."""
        return step(self.model, windows, self.period, applied, (beginning.acceleration, beginning.direction))


def accelerations(
    model: Dynamics, windows: Windows, applied: Array, guess: Array, free: Sequence[int] = ()
) -> tuple[Array, Array]:
    """The acceleration under an applied torque, and the direction that dry friction opposes.

    applied : (windows, joints) N m or N
    guess   : (windows, joints) accelerations to start from
    free    : joints that no dry friction holds: their direction is that of the windows
    Returns   accelerations rad/s² or m/s² (0 where a joint sticks) and directions -1, 0, 1, (windows, joints) each
    """
    resting = windows.dq == 0.0
    direction = np.where(resting, 0.0, np.sign(windows.dq))
    for joint in free:
        direction[:, joint] = np.where(resting[:, joint], windows.direction[:, joint], direction[:, joint])
        resting[:, joint] = False
    if not resting.any():
        windows = replace(windows, direction=direction)
        return _solved(model, windows, applied, guess, np.zeros(resting.shape, bool))[0], direction
    stuck = resting.copy()
    # one joint that breaks away may free the next one, so there are as many rounds as joints
    acceleration = guess
    for _ in range(windows.q.shape[1] + 1):
        windows = replace(windows, direction=direction)
        acceleration, slope = _solved(model, windows, applied, np.where(stuck, 0.0, guess), stuck)
        movable = stuck & _movable(slope)
        released, ways = _breaking_away(model, windows, applied, acceleration, movable)
        if not released.any():
            break
        direction = np.where(released, ways, direction)
        stuck &= ~released
    # what was released against its own acceleration stays: the friction of another joint's motion holds it
    held = resting & ~stuck & (acceleration * direction < 0)
    return np.where(held, 0.0, acceleration), np.where(held | stuck, 0.0, direction)


def _movable(slope: Array) -> Mask:
    """(windows, joints) those with an inertia: one that stands still in the whole record has none in the model, and stays
    where it is.

    slope : (windows, joints, joints), of the torque over the acceleration
    """
    inertias = np.abs(np.diagonal(slope, axis1=1, axis2=2))
    return inertias > LEAST_INERTIA * inertias.max(axis=1, keepdims=True)


def _breaking_away(
    model: Dynamics, windows: Windows, applied: Array, acceleration: Array, stuck: Mask
) -> tuple[Mask, Array]:
    """Joints at rest whose torque exceeds the friction that can hold them, and the way that they set off."""
    limits = []
    for way in (1.0, -1.0):
        tried = replace(windows, direction=np.where(stuck, way, windows.direction))
        limits.append(model.torque(tried, acceleration))
    forwards = stuck & (applied > np.maximum(*limits))
    backwards = stuck & (applied < np.minimum(*limits))
    return forwards | backwards, np.where(forwards, 1.0, -1.0)


def _solved(
    model: Dynamics, windows: Windows, applied: Array, guess: Array, stuck: Mask
) -> tuple[Array, Array]:
    """Newton's method on torque(acceleration) = applied, stuck joints held at rest: the acceleration, and the slope of the
    torque over it where the method began.

    Friction α |load| has a kink where the load is zero; the torque grows with the acceleration on both sides as long as α < 1, so
    that the solution is the only one and Newton's method finds it. Friction with a step up there (beta_m − beta_g of eq. 29)
    leaves torques between its sides without a solution: Newton's method goes to and fro across the step, and the load rests
    at zero (Filippov), which the way between the iterates is halved to find. Between the sides of a step down there are two
    solutions, either of which may be found.
    """
    acceleration = np.where(stuck, 0.0, guess)
    torque, begun = model.with_slope(windows, acceleration)
    slope = begun
    held = stuck[:, :, None] | stuck[:, None, :]
    size = SETTLED * np.maximum(1e-12, np.max(np.abs(applied), initial=0.0))
    best, least = acceleration, np.full(len(acceleration), np.inf)
    before = acceleration
    for iteration in range(MOST_ITERATIONS):
        left = np.where(stuck, 0.0, applied - torque)
        worst = np.max(np.abs(left), axis=1)
        better = worst < least
        best = np.where(better[:, None], acceleration, best)
        least = np.where(better, worst, least)
        if worst.max(initial=0.0) <= size:
            return best, begun
        inertia = np.where(held, 0.0, slope)
        inertia += np.where(stuck, 1.0, 0.0)[:, :, None] * np.eye(stuck.shape[1])
        before = acceleration
        acceleration = acceleration + np.linalg.solve(inertia, left[:, :, None])[:, :, 0]
        if model.linear:
            return acceleration, begun
        torque, slope = model.with_slope(windows, acceleration)
        if iteration == MOST_ITERATIONS - 1:
            worst = np.max(np.abs(np.where(stuck, 0.0, applied - torque)), axis=1)
            best = np.where((worst < least)[:, None], acceleration, best)
            least = np.minimum(least, worst)
    rested = _across_a_step(model, windows, applied, (before, acceleration), stuck, best, least > size)
    return rested, begun


def _across_a_step(
    model: Dynamics,
    windows: Windows,
    applied: Array,
    iterates: tuple[Array, Array],
    stuck: Mask,
    best: Array,
    unsolved: Mask,
) -> Array:
    """The accelerations at which what is left of the torque turns round between the last two iterates of unsolved windows."""
    below, above = iterates
    way = above - below

    def ahead(acceleration: Array) -> Array:
        """(windows,) whether what is left of the torque points along the way."""
        left = np.where(stuck, 0.0, applied - model.torque(windows, acceleration))
        return (left * way).sum(axis=1)

    crossed = unsolved & (ahead(below) > 0.0) & (ahead(above) < 0.0)
    if not crossed.any():
        return best
    for _ in range(MOST_HALVINGS):
        middle = 0.5 * (below + above)
        further = (ahead(middle) > 0.0)[:, None]
        below, above = np.where(further, middle, below), np.where(further, above, middle)
    return np.where(crossed[:, None], 0.5 * (below + above), best)


@dataclass(frozen=True)
class Predicted:
    """Where a step leads with the acceleration of its beginning.

    middle  : the windows there; a joint that stops within the step is at rest where it stops
    stops   : (windows, joints) whether it does
    instant : s after the beginning at which it does
    """

    middle: Windows
    stops: Mask
    instant: Array


def step(
    model: TorqueModel, windows: Windows, period: float, applied: Array, beginning: tuple[Array, Array]
) -> tuple[Windows, Array]:
    """The windows one step later, and a guess of the acceleration there.

    applied   : torque at the end of the step, (windows, joints)
    beginning : acceleration and direction at the beginning, as `accelerations` gives them
    Second order (Heun 1900), so that the energy of a joint without friction drifts with the square of the step.
    """
    first, direction = beginning
    predicted = prediction(model, windows, period, first, direction)
    second, onwards = accelerations(model, predicted.middle, applied, first)
    ended = correction(model, windows, period, predicted, (first, second), direction)
    return ended, np.where(predicted.stops, second, np.where(onwards == 0.0, 0.0, second))


def prediction(
    model: TorqueModel, windows: Windows, period: float, first: Array, direction: Array
) -> Predicted:
    """The end of a step of `period` s with the acceleration at its beginning."""
    velocity = windows.dq + period * first
    stops = (windows.dq * velocity < 0.0) & (windows.dq != 0.0)
    with np.errstate(divide="ignore", invalid="ignore"):
        instant = np.where(stops, -windows.dq / np.where(first == 0.0, 1.0, first), 0.0)
    position = windows.q + np.where(
        stops, 0.5 * windows.dq * instant, period * windows.dq + 0.5 * period**2 * first
    )
    middle = replace(
        windows,
        time=windows.time + period,
        q=position,
        dq=np.where(stops, 0.0, velocity),
        direction=direction,
        memory=model.advanced(windows.memory, windows.q, position),
    )
    return Predicted(middle, stops, instant)


def correction(
    model: TorqueModel,
    windows: Windows,
    period: float,
    predicted: Predicted,
    both: tuple[Array, Array],
    direction: Array,
) -> Windows:
    """The end of a step with the accelerations at its beginning and at its end, `both`."""
    first, second = both
    stops, position = predicted.stops, predicted.middle.q
    rest = np.where(stops, period - predicted.instant, 0.0)
    velocity = np.where(stops, rest * second, windows.dq + 0.5 * period * (first + second))
    # a joint that set off, or moved, the one way does not pass rest unseen in the other
    before = np.where(windows.dq != 0.0, np.sign(windows.dq), direction)
    velocity = np.where(~stops & (velocity * before < 0.0), 0.0, velocity)
    moved = np.where(
        stops,
        position + 0.5 * rest**2 * second,
        windows.q + period * windows.dq + period**2 * (2.0 * first + second) / 6.0,
    )
    turned = np.where(stops, position, windows.q)
    ended = replace(
        predicted.middle,
        q=moved,
        dq=velocity,
        direction=np.where(velocity == 0.0, 0.0, np.sign(velocity)),
        memory=model.advanced(model.advanced(windows.memory, windows.q, turned), turned, moved),
    )
    return model.struck(windows, ended) if model.meets else ended
