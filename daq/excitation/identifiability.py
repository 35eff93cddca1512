"""What a plan covers, and which physical effects it cannot show: said before anything moves."""

from collections.abc import Sequence
from dataclasses import asdict, dataclass
from typing import Any

import numpy as np

from daq.excitation.plan_model import PlanModel, PlannedMotion
from daq.rig import Rig

SLOW = 0.05
"""of the highest speed: what counts as slow; the Stribeck effect of robot gears lies below"""

STEADY = 0.1
"""s that a slow speed must last at its present rate of change: passing through zero on the way is not
slow motion
"""

FAST = 0.5
"""of the highest speed: what counts as fast"""

ENOUGH = 0.02
"""of the moving time that must be spent somewhere (slow, in a quadrant, …) to say that it is covered"""

WIDE = 0.5
"""of the position range: below, springs and position-dependent friction hide behind gravity"""

WARMUP_SECONDS = 60.0
"""a session must last about so long that friction can be seen to fall; a plan for 60 s is some hundredths shorter"""


@dataclass(frozen=True)
class JointCoverage:
    """What the sessions of a plan make one joint do; shares are of the joint's moving time over all
    sessions.
    """

    joint: str
    position_range: tuple[float, float]
    """rad or m"""
    position_share: float
    """of the range that the limits allow"""
    highest_speed_share: float
    """of the speed that the limits allow"""
    slow_forwards: float
    slow_backwards: float
    """share of time at a steady speed below 5 % of the highest, by direction"""
    fast: float
    """share of time above 50 % of the highest speed"""
    quadrants: tuple[float, float, float, float]
    """share of time in quadrants 1 to 4 of Fig. 2, (speed, load): (+, +), (−, +), (−, −), (+, −)"""
    load_range: tuple[float, float]
    """N m, as predicted, over all sessions"""
    payload_masses: tuple[float, ...]
    """kg, of the sessions"""

    def to_json(self) -> dict[str, Any]:
        """As plain data."""
        return asdict(self)


@dataclass(frozen=True)
class Hidden:
    """Effects of one joint that the plan cannot show, with the reason and what would show them."""

    joint: str
    effects: tuple[str, ...]
    reason: str
    remedy: str


def coverage(model: PlanModel, motions: Sequence[PlannedMotion], rig: Rig) -> tuple[JointCoverage, ...]:
    """What each joint does over all sessions."""
    loads = np.concatenate([model.load(motion) for motion in motions])
    q = np.concatenate([motion.q for motion in motions])
    dq = np.concatenate([motion.dq for motion in motions])
    ddq = np.concatenate([motion.ddq for motion in motions])
    coverage: list[JointCoverage] = []
    for j, axis in enumerate(rig.axes):
        limits = axis.limits
        moving = dq[:, j] != 0.0
        speed, load = dq[moving, j], loads[moving, j]
        slow = np.abs(ddq[moving, j]) * STEADY < np.abs(speed)
        share = np.abs(speed) / limits.velocity
        slow &= share < SLOW
        count = max(len(speed), 1)

        def part(chosen: np.ndarray, count: int = count) -> float:
            return float(np.count_nonzero(chosen) / count)

        coverage.append(
            JointCoverage(
                joint=axis.joint,
                position_range=(float(q[:, j].min()), float(q[:, j].max())),
                position_share=float(np.ptp(q[:, j]) / (limits.position[1] - limits.position[0])),
                highest_speed_share=float(share.max(initial=0.0)),
                slow_forwards=part(slow & (speed > 0)),
                slow_backwards=part(slow & (speed < 0)),
                fast=part(share > FAST),
                quadrants=(
                    part((speed > 0) & (load > 0)),
                    part((speed < 0) & (load > 0)),
                    part((speed < 0) & (load < 0)),
                    part((speed > 0) & (load < 0)),
                ),
                load_range=(float(loads[:, j].min()), float(loads[:, j].max())),
                payload_masses=tuple(motion.payload.mass for motion in motions),
            )
        )
    return tuple(coverage)


def hidden_effects(
    covered: Sequence[JointCoverage], session_seconds: float, records_temperature: bool
) -> list[Hidden]:
    """Effects of the catalogue that sessions with this coverage cannot show, joint by joint."""
    found: list[Hidden] = []
    for joint in covered:

        def hide(reason: str, remedy: str, *effects: str, name: str = joint.joint) -> None:
            found.append(Hidden(name, effects, reason, remedy))

        if len(set(joint.payload_masses)) < 2:
            hide(
                "no payload change",
                "plan sessions with and without a payload",
                *("load-friction", "load-friction-asymmetric", "load-stribeck"),
            )
        if not any(joint.payload_masses):
            hide(
                "no payload",
                "plan a session with a weighed payload",
                *("drive-gain", "payload-mass", "payload-com"),
            )
        if min(joint.slow_forwards, joint.slow_backwards) < ENOUGH:
            hide(
                f"no slow motion (below {SLOW:.0%} of the highest speed, both ways)",
                "give the plan more seconds",
                *("stribeck", "load-stribeck", "presliding"),
            )
        if joint.highest_speed_share < FAST or joint.fast < ENOUGH:
            hide(
                f"no fast motion (above {FAST:.0%} of the highest speed)",
                "give the joint more room or acceleration",
                *("viscous-quadratic", "viscous-cubic", "viscous-power", "viscous-asymmetric"),
            )
        empty = [str(k + 1) for k, share in enumerate(joint.quadrants) if share < ENOUGH]
        if empty:
            hide(
                f"quadrant{'s' if len(empty) > 1 else ''} {', '.join(empty)} of speed and load hardly visited",
                "widen the position limits so that gravity loads the joint both ways, or mount a payload",
                *("load-friction-asymmetric", "load-stribeck"),
            )
        if joint.position_share < WIDE:
            hide(
                f"only {joint.position_share:.0%} of the position range",
                "widen the motion",
                *("joint-spring", "friction-position", "gravity-tilt"),
            )
        if session_seconds < 0.95 * WARMUP_SECONDS:
            hide(
                f"a session lasts {session_seconds:.0f} s only",
                f"plan at least {WARMUP_SECONDS:.0f} s",
                "friction-warmup",
            )
        if not records_temperature:
            hide(
                "no temperature is recorded",
                "set record_temperature in the rig file where the drive reports one",
                "friction-temperature",
            )
    return found
