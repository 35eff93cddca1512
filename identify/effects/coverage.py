"""What the motion of a record or of a plan makes one joint do: the one meaning of slow, fast and wide."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]

SLOW = 0.10
"""of the top speed: the paper's low velocities (Table III), below which the Stribeck effect of robot gears lies"""

STEADY = 0.1
"""s that a slow speed must last at its present rate of change: passing through zero on the way is not slow motion"""

FAST = 0.35
"""of the speed that the joint's limit allows: the paper's high velocities (Table III)"""


@dataclass(frozen=True)
class JointLimits:
    """What a joint may do: range of position, rad or m, and speed, rad/s or m/s."""

    position: tuple[float, float]
    speed: float


@dataclass(frozen=True)
class Coverage:
    """What the sessions make one joint do; shares are of the joint's moving time over all sessions."""

    slow_forwards: float
    slow_backwards: float
    """at a steady speed below `SLOW` of the top speed, by direction"""
    forwards: float
    backwards: float
    fast: float | None
    """above `FAST` of the limit; None where no limit is known"""
    top_speed_share: float | None
    """of the limit that the top speed is"""
    position_share: float | None
    """of the range between the limits that is driven"""
    quadrants: tuple[float, float, float, float] | None
    """in quadrants 1 to 4 of Fig. 2, (speed, load): (+, +), (−, +), (−, −), (+, −); None where the load is not known"""

    @classmethod
    def of(
        cls, q: Array, dq: Array, ddq: Array, load: Array | None = None, limits: JointLimits | None = None
    ) -> "Coverage":
        """Of samples in equal steps of time, (samples,) each, SI; where dq is 0 the joint rests."""
        moving = dq != 0.0
        speed, rate = dq[moving], np.abs(ddq[moving])
        size = np.abs(speed)
        top = float(size.max(initial=0.0))
        slow = (size < SLOW * top) & (rate * STEADY < size)

        def share(chosen: np.ndarray) -> float:
            return float(np.count_nonzero(chosen) / max(len(speed), 1))

        quadrants = None
        if load is not None:
            carried = load[moving]
            quadrants = (
                share((speed > 0) & (carried > 0)),
                share((speed < 0) & (carried > 0)),
                share((speed < 0) & (carried < 0)),
                share((speed > 0) & (carried < 0)),
            )
        return cls(
            slow_forwards=share(slow & (speed > 0)),
            slow_backwards=share(slow & (speed < 0)),
            forwards=share(speed > 0),
            backwards=share(speed < 0),
            fast=None if limits is None else share(size > FAST * limits.speed),
            top_speed_share=None if limits is None else top / limits.speed,
            position_share=None
            if limits is None
            else float(np.ptp(q) / (limits.position[1] - limits.position[0])),
            quadrants=quadrants,
        )
