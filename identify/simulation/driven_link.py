"""The link behind a motor whose motion was measured: how far it lags, and what the gear carries.

With theta of the motor, L = tau_out of eq. (6) along it, B the inertia on the motor's side, J that of the link, G the slope of
L over the position and x the twist, the link's equation of motion (Spong 1987) is, to the first order in x,

    J x'' + s = f − G x + r,   f = L − B theta'',   s the torque that the gear carries: x + T_r x' = twist(s)

r = F sign(theta' − x') is the dry friction of the link; where that speed is zero it is what holds the link there, up to F.
A pendulum that hangs on a known motion: integrating it is stable, and the future of the motion has no part in it.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import solve_banded

from identify.effects.give import Give
from identify.simulation.link_friction import FLANK, link_friction

Array = NDArray[np.float64]

SLOPE_STEP = 1e-6
"""rad or m, of the difference quotient of the load over a joint's position"""

SEGMENT = 1.0
"""s of a record that a link with a gap is followed over at once, side by side with the other parts of the record"""

RUN_IN = 0.3
"""s before it, within which a link in its gap meets a flank and forgets where it was taken to begin"""

PERIODS = 1.5
"""of a link on its spring, over which it begins as near as it can to where its load would hold it at rest"""


@dataclass(frozen=True, eq=False)
class DrivenLink:
    """What drives the link of a joint over a stretch of a record; (N,) or (N, joints), SI units.

    joint    : whose transmission gives
    dq       : (N,) speed of its motor
    ddq      : (N,) its acceleration
    load     : (N,) its tau_out at the motors' motion
    slopes   : (N, joints) of every joint's tau_out over the position of this one
    inertias : (N, joints) over its acceleration, the rotor of the joint included
    """

    joint: int
    period: float
    dq: Array
    ddq: Array
    load: Array
    slopes: Array
    inertias: Array

    def free_torque(self, give: Give) -> Array:
        """(N,) f: what the gear of a transmission that does not give carries."""
        return self.load - give.rotor * self.ddq

    def link_inertia(self, give: Give) -> Array:
        """(N,) J."""
        return self.inertias[:, self.joint] - give.rotor

    def torque(self, give: Give, lag: LinkLag) -> Array:
        """(N, joints) N m or N: what the motors give because the transmission gives, beside the rigid robot's torque."""
        free = self.free_torque(give)
        driven = free - self.slopes[:, self.joint] * lag.twist + lag.friction
        swing = (driven - lag.carried) / self.link_inertia(give)
        torque = -self.slopes * lag.twist[:, None] - self.inertias * swing[:, None]
        torque[:, self.joint] = lag.carried - free
        return torque


def driven_link(
    joint: int, period: float, motion: tuple[Array, Array, Array], loads: Callable[[Array, Array], Array]
) -> DrivenLink:
    """What drives the link of a joint over rows of a motion.

    motion : positions, speeds and accelerations of the motors, (N, joints) each
    loads  : (N, joints) tau_out for positions and accelerations of these rows
    """
    q, dq, ddq = motion
    moved, faster = q.copy(), ddq.copy()
    moved[:, joint] += SLOPE_STEP
    faster[:, joint] += 1.0
    load = loads(q, ddq)
    slopes = (loads(moved, ddq) - load) / SLOPE_STEP
    inertias = loads(q, faster) - load
    return DrivenLink(joint, period, dq[:, joint], ddq[:, joint], load[:, joint], slopes, inertias)


@dataclass(frozen=True, eq=False)
class LinkLag:
    """Of a link behind its motor; (N,), SI units.

    twist    : how far the motor stands ahead
    carried  : s
    friction : r
    swings   : (N, 2) what the gear carries more for each unit of twist at the first two rows; none where the link forgets them
    """

    twist: Array
    carried: Array
    friction: Array
    swings: Array


def link_lags(give: Give, links: Sequence[DrivenLink]) -> list[LinkLag]:
    """How links lag behind their motors with a give, each over a stretch of its own."""
    if give.gap:
        return _stepped(give, links)
    lags = [_on_a_spring(give, link) for link in links]
    return _stepped(give, links, lags) if give.link_dry else lags


def _on_a_spring(give: Give, link: DrivenLink) -> LinkLag:
    """By the trapezoidal rule (Newmark 1959), all rows at once; the first two rows are where the link begins quietest.

    Dry friction of the link opposes the motion of its motor here.
    """
    stiffness, step = 1.0 / give.compliance, link.period
    damping = give.relaxation * stiffness / (2.0 * step)
    friction = give.link_dry * np.sign(link.dq)
    mass, free = link.link_inertia(give) / step**2, link.free_torque(give) + friction
    whole = stiffness + link.slopes[:, link.joint]
    rows, inner = len(free), slice(1, -1)
    bands, driven = np.zeros((3, rows)), np.zeros((rows, 3))
    bands[0, :2] = 1.0
    bands[0, 2:] = mass[inner] + damping + whole[2:] / 4
    bands[1, 1:-1] = -2.0 * mass[inner] + whole[inner] / 2
    bands[2, :-2] = mass[inner] - damping + whole[:-2] / 4
    driven[2:, 0] = (free[2:] + 2.0 * free[inner] + free[:-2]) / 4
    driven[0, 1] = driven[1, 2] = 1.0
    courses = solve_banded((2, 0), bands, driven)
    period = 2.0 * np.pi * np.sqrt(float(np.mean(link.link_inertia(give)) / max(np.mean(whole), 1e-12)))
    begin = slice(0, int(np.clip(PERIODS * period / step, 8, rows)))
    still = free / whole - courses[:, 0]
    start = np.linalg.lstsq(courses[begin, 1:], still[begin], rcond=None)[0]
    carried = stiffness * (courses + give.relaxation * np.gradient(courses, step, axis=0))
    twist, load = (course[:, 0] + course[:, 1:] @ start for course in (courses, carried))
    return LinkLag(twist, load, friction, carried[:, 1:])


def _stepped(give: Give, links: Sequence[DrivenLink], begun: Sequence[LinkLag] = ()) -> list[LinkLag]:
    """Row by row, segments of all stretches side by side.

    Across a gap by backward Euler, as a rollout does; on a spring, on which links have `begun`, by the trapezoidal rule.
    """
    step = links[0].period
    before, length = round(RUN_IN / step), max(2, round(SEGMENT / step))
    parts, counts = [], []
    for number, link in enumerate(links):
        starts = np.arange(0, len(link.load), length)
        rows = np.maximum(0, starts - before + np.arange(before + length)[:, None])
        rows = np.minimum(rows, len(link.load) - 1)
        table = [link.free_torque(give), link.link_inertia(give), link.slopes[:, link.joint], link.dq]
        if begun:
            rate = np.gradient(begun[number].twist, link.period)
            table += [begun[number].twist, rate, np.gradient(rate, link.period)]
        parts.append(np.stack(table)[:, rows])
        counts.append(len(starts))
    free, inertia, slope, speed, *courses = np.concatenate(parts, axis=2)
    h = np.repeat([link.period for link in links], counts)
    late = 0.5 * h if begun else h
    further = late * (late if begun else h)
    states = np.empty((3, *free.shape))
    twist, rate, swing = (
        (each[0] for each in courses)
        if courses
        else (give.twist(free[0] + give.link_dry * np.sign(speed[0])), 0.0 * h, 0.0 * h)
    )
    for row in range(len(free)):
        going = speed[max(0, row - 1)] - rate
        reached = twist + h * rate
        if begun:
            reached, rate = reached + further * swing, rate + late * swing
        step_on = _Step(
            give,
            inertia[row],
            free[row] - slope[row] * (reached if begun else twist),
            reached + give.relaxation * rate,
            further + give.relaxation * late,
            speed[row] - rate,
            late,
        )
        friction = np.zeros(len(h))
        if give.link_dry:
            carried, friction = step_on.solved_with_friction(going)
        else:
            carried = step_on.carried(friction)
        swing = step_on.swing(carried, friction)
        twist, rate = reached + further * swing, rate + late * swing
        states[:, row] = twist, carried, friction
    lags, first = [], 0
    for number, (link, count) in enumerate(zip(links, counts, strict=True)):
        columns = slice(first, first + count)
        rows = len(link.load)
        twist, carried, friction = states[:, before:, columns].transpose(0, 2, 1).reshape(3, -1)[:, :rows]
        swings = begun[number].swings if begun else np.zeros((rows, 0))
        lags.append(LinkLag(twist, carried, friction, swings))
        first += count
    return lags


@dataclass(frozen=True)
class _Step:
    """One step of links behind motors, (windows,): what their swing x'' makes of it is linear in x''.

    driven   : N m or N, all that acts on x but what is carried and dry friction
    reached  : x + T_r x' at the end with x'' = 0; `weight` · x'' more of it
    speed    : of the link at the end with x'' = 0; `late` · x'' less
    """

    give: Give
    inertia: Array
    driven: Array
    reached: Array
    weight: Array
    speed: Array
    late: Array

    def carried(self, friction: Array) -> Array:
        """What the gear carries under a friction."""
        yielding = self.weight / self.inertia
        return self.give.load_where(self.reached + yielding * (self.driven + friction), yielding)

    def swing(self, carried: Array, friction: Array) -> Array:
        """x''."""
        return (self.driven + friction - carried) / self.inertia

    def solved_with_friction(self, going: Array) -> tuple[Array, Array]:
        """What is carried and what dry friction takes, of links that went with a speed until now."""

        def solved(friction: Array) -> tuple[Array, Array]:
            carried = self.carried(friction)
            return carried, self.speed - self.late * self.swing(carried, friction)

        def holding() -> Array:
            still = self.speed / self.late
            # flanks that do not give are taken to do so by a little, for a motor that measurement moves a little into them
            yielding = 0.0 if self.give.compliance else FLANK * self.weight / self.inertia
            carried = self.give.load_where(self.reached + self.weight * still, np.asarray(yielding))
            return self.inertia * still - self.driven + carried

        return link_friction(self.give.link_dry, going, solved, holding)
