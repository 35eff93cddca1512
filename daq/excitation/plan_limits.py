"""A plan against the limits of its rig, before anything moves."""

from dataclasses import dataclass

import numpy as np

from daq.excitation.blend import Array
from daq.excitation.excitation_plan import ExcitationPlan
from daq.rig import Rig
from identify.recording.errors import InputError

SAMPLING = 0.001
"""s: how densely a plan is looked at. Its highest harmonics are some Hz, so a peak is missed by parts per
million.
"""

TOLERANCE = 1e-6
"""relative: a plan may touch its limit, rounding apart"""


@dataclass(frozen=True)
class Violation:
    """One limit that a plan breaks, where it breaks it most."""

    joint: str
    quantity: str
    time: float
    """s"""
    value: float
    limit: float
    unit: str

    def __str__(self) -> str:
        return (
            f"joint {self.joint}: {self.quantity} {self.value:.4g} {self.unit} at {self.time:.3f} s "
            f"is beyond the limit of {self.limit:.4g} {self.unit}"
        )


def require_same_joints(plan: ExcitationPlan, rig: Rig) -> None:
    """Raises InputError where a plan moves other joints than a rig has."""
    names = tuple(axis.joint for axis in rig.axes)
    if plan.joints != names:
        raise InputError(
            f"plan {plan.name or '(unnamed)'}: its joints ({', '.join(plan.joints)}) are not those of "
            f"rig {rig.name} ({', '.join(names)})"
        )


def violations(
    plan: ExcitationPlan, rig: Rig, torque: Array | None = None, times: Array | None = None
) -> list[Violation]:
    """Every limit of the rig that the plan breaks, the first in time first.

    torque : (N, n) predicted joint torque at `times` (N,); it is turned into a current with the rig's
             drive gain. Raises InputError where the plan's joints are not the rig's.
    """
    require_same_joints(plan, rig)
    if times is None:
        times = without_repeats(plan, sampling_times(plan))
    position, velocity, acceleration, jerk = plan.evaluate(times)
    current = None if torque is None else np.asarray(np.linalg.solve(rig.drive_gain, torque.T).T, dtype=float)
    broken: list[Violation] = []
    for j, axis in enumerate(rig.axes):
        limits = axis.limits
        prismatic = rig.robot.joints[j].type == "prismatic"
        unit = "m" if prismatic else "rad"
        low, high = limits.position
        checks = [
            ("position", position[:, j], low, high, unit),
            ("velocity", velocity[:, j], -limits.velocity, limits.velocity, f"{unit}/s"),
            ("acceleration", acceleration[:, j], -limits.acceleration, limits.acceleration, f"{unit}/s²"),
            ("jerk", jerk[:, j], -limits.jerk, limits.jerk, f"{unit}/s³"),
        ]
        if current is not None:
            checks.append(("predicted current", current[:, j], -limits.current, limits.current, "A"))
        for quantity, values, lowest, highest, its_unit in checks:
            slack = TOLERANCE * (highest - lowest)
            beyond = np.maximum(values - highest, lowest - values)
            worst = int(np.argmax(beyond))
            if beyond[worst] > slack:
                limit = highest if values[worst] > highest else lowest
                broken.append(
                    Violation(
                        axis.joint, quantity, float(times[worst]), float(values[worst]), limit, its_unit
                    )
                )
    return sorted(broken, key=lambda violation: violation.time)


def sampling_times(plan: ExcitationPlan) -> Array:
    """(N,) s: the times at which a plan is looked at, both ends included."""
    return np.linspace(0.0, plan.duration, max(2, int(np.ceil(plan.duration / SAMPLING)) + 1))


def without_repeats(plan: ExcitationPlan, times: Array) -> Array:
    """Those of `times` (N,), s, at which the motion does not only repeat what it did a period before."""
    repeats = np.zeros(len(times), bool)
    for begin, end, period in plan.repeated:
        repeats |= (times > begin + period + SAMPLING) & (times < end)
    return times[~repeats]


def require_within_limits(
    plan: ExcitationPlan, rig: Rig, torque: Array | None = None, times: Array | None = None
) -> None:
    """Refuse a plan that breaks a limit.

    Raises InputError that names joint, time and value of the first violation and how many more there are.
    """
    broken = violations(plan, rig, torque, times)
    if broken:
        more = f" (and {len(broken) - 1} more)" if len(broken) > 1 else ""
        raise InputError(f"plan {plan.name or '(unnamed)'}: {broken[0]}{more}")
