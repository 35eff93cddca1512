"""The give between a motor and its link: how far the motor stands ahead of the link under what it carries."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]

LEAST_SHARE = 0.1
"""of a joint's inertia that stands on either side of the give at least: identification tells the inertia of both together"""

MOST_ITERATIONS = 60


@dataclass(frozen=True, eq=False)
class JointCourse:
    """What a joint did over a stretch of a record; (samples,), SI units.

    span       : range of the joint's position, rad or m
    load       : tau_out of eq. (6)
    load_slope : its derivative over the joint's position
    inertia    : its derivative over the joint's acceleration, rotor included
    """

    period: float
    span: float
    dq: Array
    ddq: Array
    load: Array
    load_slope: Array
    inertia: Array

    def second_derivative(self, values: Array) -> Array:
        """Of a course over time, as an effect's columns have it."""
        return np.gradient(np.gradient(values, self.period), self.period)


@dataclass(frozen=True)
class Give:
    """twist(load) = compliance · load + gap/2 · tanh(load / flank_load): a spring and a gap in series; SI units.

    rotor      : kg m² or kg, inertia on the motor's side
    compliance : rad/(N m) or m/N
    gap        : rad or m, from flank to flank
    flank_load : N m or N, at which three quarters of half the gap are taken up
    beside     : coefficients of `at_instant`: torque that the estimates do not have and the two masses make
    """

    rotor: float
    compliance: float = 0.0
    gap: float = 0.0
    flank_load: float = 1.0
    beside: tuple[float, ...] = ()

    def twist(self, load: Array) -> Array:
        """How far the motor stands ahead of the link, rad or m."""
        return self.compliance * load + 0.5 * self.gap * np.tanh(load / self.flank_load)

    def load_where(self, free: Array, yielding: Array) -> Array:
        """The load with twist(load) + yielding · load = free.

        free     : twist that there would be if nothing was carried
        yielding : rad/(N m) or m/N by which motor and link come together under the load; above zero where there is a gap
        """
        linear = self.compliance + yielding
        if not self.gap:
            return free / linear
        # concave above zero: from a point below the solution Newton's steps stay below it and grow
        size = np.abs(free)
        load = np.maximum(0.0, (size - 0.5 * self.gap) / linear)
        for _ in range(MOST_ITERATIONS):
            taken = np.tanh(load / self.flank_load)
            slope = linear + 0.5 * self.gap / self.flank_load * (1.0 - taken**2)
            change = (size - linear * load - 0.5 * self.gap * taken) / slope
            load = load + change
            if np.all(np.abs(change) <= 1e-12 * (self.flank_load + load)):
                break
        return np.copysign(load, free)

    def energy(self, load: Array) -> Array:
        """J, stored in the spring and in flanks that give."""
        ratio = np.abs(load) / self.flank_load
        log_cosh = ratio + np.log1p(np.exp(-2.0 * ratio)) - np.log(2.0)
        return 0.5 * self.compliance * load**2 + 0.5 * self.gap * self.flank_load * (
            ratio * np.tanh(ratio) - log_cosh
        )

    def in_series_with(self, other: Give) -> Give:
        """Both between the same motor and link; the rotor is that of the one that has a spring."""
        spring, gap = (self, other) if self.compliance else (other, self)
        return replace(spring, gap=gap.gap, flank_load=gap.flank_load)


def at_instant(load: Array, load_slope: Array, dq: Array, ddq: Array) -> Array:
    """(samples, 6) what a fit has beside a give: load and its change with the position, acceleration, friction, offset."""
    return np.column_stack([load, load * load_slope, ddq, dq, np.sign(dq), np.ones(len(load))])


def share_of_link(share: float) -> float:
    """The link's share of a joint's inertia, within what it can be."""
    return min(max(share, LEAST_SHARE), 1.0 - LEAST_SHARE)
