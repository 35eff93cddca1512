"""The link behind a motor whose motion was measured: how far it lags, and what the gear carries.

With theta of the motor, L = tau_out of eq. (6) along it, B the inertia on the motor's side, J that of the link, G the slope of
L over the position and x the twist, the link's equation of motion (Spong 1987) is, to the first order in x,

    J x'' + s = f − G x,   f = L − B theta'',   s the torque that the gear carries: x + T_r x' = twist(s)

A pendulum that hangs on a known motion: integrating it is stable, and the future of the motion has no part in it.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import solve_banded

from identify.effects.give import Give

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
    ddq      : (N,) acceleration of its motor
    load     : (N,) its tau_out at the motors' motion
    slopes   : (N, joints) of every joint's tau_out over the position of this one
    inertias : (N, joints) over its acceleration, the rotor of the joint included
    """

    joint: int
    period: float
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
        swing = (free - self.slopes[:, self.joint] * lag.twist - lag.carried) / self.link_inertia(give)
        torque = -self.slopes * lag.twist[:, None] - self.inertias * swing[:, None]
        torque[:, self.joint] = lag.carried - free
        return torque


def driven_link(
    joint: int, period: float, motion: tuple[Array, Array], loads: Callable[[Array, Array], Array]
) -> DrivenLink:
    """What drives the link of a joint over rows of a motion.

    motion : positions and accelerations of the motors, (N, joints) each
    loads  : (N, joints) tau_out for positions and accelerations of these rows
    """
    q, ddq = motion
    moved, faster = q.copy(), ddq.copy()
    moved[:, joint] += SLOPE_STEP
    faster[:, joint] += 1.0
    load = loads(q, ddq)
    slopes = (loads(moved, ddq) - load) / SLOPE_STEP
    return DrivenLink(joint, period, ddq[:, joint], load[:, joint], slopes, loads(q, faster) - load)


@dataclass(frozen=True, eq=False)
class LinkLag:
    """Of a link behind its motor; (N,), SI units.

    twist   : how far the motor stands ahead
    carried : s
    swings  : (N, 2) what the gear carries more for each unit of twist at the first two rows; none where the link forgets them
    """

    twist: Array
    carried: Array
    swings: Array


def link_lags(give: Give, links: Sequence[DrivenLink]) -> list[LinkLag]:
    """How links lag behind their motors with a give, each over a stretch of its own."""
    return _across_gaps(give, links) if give.gap else [_on_a_spring(give, link) for link in links]


def _on_a_spring(give: Give, link: DrivenLink) -> LinkLag:
    """By the trapezoidal rule (Newmark 1959), all rows at once; the first two rows are where the link begins quietest."""
    stiffness, step = 1.0 / give.compliance, link.period
    damping = give.relaxation * stiffness / (2.0 * step)
    mass, free = link.link_inertia(give) / step**2, link.free_torque(give)
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
    return LinkLag(
        courses[:, 0] + courses[:, 1:] @ start, carried[:, 0] + carried[:, 1:] @ start, carried[:, 1:]
    )


def _across_gaps(give: Give, links: Sequence[DrivenLink]) -> list[LinkLag]:
    """By backward Euler, as a rollout does; segments of all stretches side by side."""
    step = links[0].period
    before, length = round(RUN_IN / step), max(2, round(SEGMENT / step))
    parts, counts = [], []
    for link in links:
        starts = np.arange(0, len(link.load), length)
        rows = np.maximum(0, starts - before + np.arange(before + length)[:, None])
        rows = np.minimum(rows, len(link.load) - 1)
        table = np.stack([link.free_torque(give), link.link_inertia(give), link.slopes[:, link.joint]])
        parts.append(table[:, rows])
        counts.append(len(starts))
    free, inertia, slope = np.concatenate(parts, axis=2)
    steps = np.repeat([link.period for link in links], counts)
    yielding = steps**2 / inertia
    twists, carries = np.empty_like(free), np.empty_like(free)
    twist, rate = give.twist(free[0]), np.zeros(free.shape[1])
    for row in range(len(free)):
        reached = twist + steps * rate + yielding[row] * (free[row] - slope[row] * twist)
        carries[row] = give.load_where(reached, yielding[row])
        twists[row] = reached - yielding[row] * carries[row]
        rate, twist = (twists[row] - twist) / steps, twists[row]
    lags, first = [], 0
    for link, count in zip(links, counts, strict=True):
        columns = slice(first, first + count)
        rows = len(link.load)
        twist, carried = (values[before:, columns].T.ravel()[:rows] for values in (twists, carries))
        lags.append(LinkLag(twist, carried, np.zeros((rows, 0))))
        first += count
    return lags
