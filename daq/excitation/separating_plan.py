"""The plan of a proposed experiment: one joint between two positions at one speed, many times, the others at rest.

Such a motion is proposed where two effects explain the data alike and predict different torques on it.
"""

from typing import Literal

import numpy as np
from pydantic import BaseModel, ConfigDict, Field

from daq.excitation.blend import Array
from daq.excitation.excitation_plan import ExcitationPlan
from daq.excitation.plan_limits import require_within_limits
from daq.excitation.sinusoid import Sinusoids
from daq.excitation.speed_ladder import Reach
from daq.excitation.standard_plan import REST, peak_times
from daq.excitation.trapezoid import Dwell, Move, move_at
from daq.rig import Rig
from identify.recording.errors import InputError

FADE = 1.0
"""periods in which a sinusoid grows to its amplitude, and again in which it ends"""

LESS = 0.99
"""Part of a proposed quantity below which the operator is told that the rig allows only this much."""


class SeparatingMotion(BaseModel):
    """What is proposed: the fields of a proposal in the document of `coulomb next --json`."""

    model_config = ConfigDict(frozen=True, extra="ignore", allow_inf_nan=False)

    shape: Literal["sinusoid", "trapezoid"]
    speed: float = Field(gt=0)
    """rad/s or m/s at most"""
    position_from: float
    position_to: float
    """rad or m: between these the joint moves"""
    repeats: int = Field(ge=1, le=1000)


def separating_plan(
    rig: Rig, joint: str, motion: SeparatingMotion, posture: Array, name: str
) -> tuple[ExcitationPlan, tuple[str, ...]]:
    """The plan of a proposed motion of `joint`, and in words what the rig's limits made of it.

    posture : (n,) rad or m: where the other joints stand meanwhile

    Raises InputError where the rig has no such joint, or leaves no way to move on.
    """
    names = [axis.joint for axis in rig.axes]
    if joint not in names:
        raise InputError(f"rig {rig.name} has no joint {joint}; it has {', '.join(names)}")
    if len(posture) != len(names):
        raise InputError(f"posture: {len(names)} positions are needed, not {len(posture)}")
    index, reach = names.index(joint), Reach.of(rig)
    low, high = np.clip([motion.position_from, motion.position_to], reach.low[index], reach.high[index])
    if not high > low:
        raise InputError(
            f"joint {joint}: rig {rig.name} cannot move between {motion.position_from:.4g} and "
            f"{motion.position_to:.4g}; its limits are {reach.low[index]:.4g} to {reach.high[index]:.4g}"
        )
    still = np.clip(np.asarray(posture, dtype=float), reach.low, reach.high)
    remarks: list[str] = []
    if high - low < LESS * (motion.position_to - motion.position_from):
        remarks.append(
            f"joint {joint} moves between {low:.4g} and {high:.4g}: further the rig's limits do not let it"
        )
    make = _swinging if motion.shape == "sinusoid" else _to_and_fro
    start, phases, speed = make(reach, index, still, (float(low), float(high)), motion)
    if speed < LESS * motion.speed:
        unit = "m/s" if rig.robot.joints[index].type == "prismatic" else "rad/s"
        remarks.append(
            f"it reaches {speed:.3g} {unit} instead of {motion.speed:.3g} {unit}: "
            "more would break a limit on velocity, acceleration or jerk"
        )
    plan = ExcitationPlan(
        name=name,
        rig=rig.name,
        joints=tuple(names),
        start=tuple(start.tolist()),
        phases=(Dwell(duration=REST), *phases, Dwell(duration=REST)),
    )
    require_within_limits(plan, rig)
    return plan, tuple(remarks)


def _swinging(
    reach: Reach, joint: int, still: Array, ends: tuple[float, float], motion: SeparatingMotion
) -> tuple[Array, tuple[Sinusoids, ...], float]:
    """Where it starts, one sinusoid about the middle, and the speed that it reaches."""
    low, high = ends
    half = 0.5 * (high - low)
    centre = still.copy()
    centre[joint] = 0.5 * (low + high)
    amplitude = np.zeros((len(still), 1))
    amplitude[joint] = half

    def swing(frequency: float) -> Sinusoids:
        return Sinusoids(
            frequency=frequency,
            repeats=motion.repeats,
            fade=FADE / frequency,
            centre=tuple(centre.tolist()),
            cosine=tuple(map(tuple, np.zeros_like(amplitude).tolist())),
            sine=tuple(map(tuple, amplitude.tolist())),
        )

    # Velocity, acceleration and jerk grow as the first, second and third power of the frequency.
    at_one = swing(1.0)
    peaks = [np.abs(term[:, joint]).max() for term in at_one.evaluate(peak_times(at_one), centre)[1:]]
    limits = (reach.velocity[joint], reach.acceleration[joint], reach.jerk[joint])
    most = min(
        (limit / peak) ** (1 / power)
        for power, (limit, peak) in enumerate(zip(limits, peaks, strict=True), 1)
    )
    frequency = float(min(motion.speed / (2 * np.pi * half), most))
    return centre, (swing(frequency),), 2 * np.pi * half * frequency


def _to_and_fro(
    reach: Reach, joint: int, still: Array, ends: tuple[float, float], motion: SeparatingMotion
) -> tuple[Array, tuple[Move, ...], float]:
    """Where it starts, the moves there and back at constant speed, and the speed that they reach."""
    here, there = still.copy(), still.copy()
    here[joint], there[joint] = ends
    velocity = reach.velocity.copy()
    velocity[joint] = min(motion.speed, velocity[joint])
    away = move_at(here, there, velocity, reach.acceleration, reach.jerk)
    back = move_at(there, here, velocity, reach.acceleration, reach.jerk)
    reached = (ends[1] - ends[0]) / (away.duration - away.ramp)
    return here, (away, back) * motion.repeats, reached
