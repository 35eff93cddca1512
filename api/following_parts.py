"""The following errors of two drives of one plan beside each other: whole, by speed, and by quadrant."""

import numpy as np
from numpy.typing import NDArray

from daq.following_error import FollowingError
from daq.rig import Rig
from daq.torque_offset import TorqueOffset
from identify.results.compensation import FollowingPart, JointFollowing

Array = NDArray[np.float64]

SLOW, FAST = 0.10, 0.35
"""of the plan's top speed: below it slow, above it fast"""


def compared(
    rig: Rig, sent: TorqueOffset, speed: Array, load: Array, without: FollowingError, with_: FollowingError
) -> tuple[JointFollowing, ...]:
    """Following errors of both drives of the plan over the cycles that both have.

    speed, load : (L, n) rad/s, N m (m/s, N) as planned, a row for each cycle
    """
    _, first, second = np.intersect1d(without.cycle, with_.cycle, return_indices=True)
    if not len(first):
        return ()
    cycle = without.cycle[first]
    before, after = without.error[first], with_.error[second]
    speed, load = speed[cycle], load[cycle]
    return tuple(
        JointFollowing(
            joint=axis.joint,
            unit="m" if rig.robot.joints[joint].type == "prismatic" else "rad",
            rms_without=_rms(before[:, joint]),
            rms_with=_rms(after[:, joint]),
            peak_without=float(np.nanmax(np.abs(before[:, joint]))),
            peak_with=float(np.nanmax(np.abs(after[:, joint]))),
            largest_offset=float(sent.largest[joint]),
            bounded=float(sent.bounded[joint]),
            speeds=_parts(_by_speed(speed[:, joint]), before[:, joint], after[:, joint]),
            quadrants=_parts(
                _by_quadrant(speed[:, joint], load[:, joint]), before[:, joint], after[:, joint]
            ),
        )
        for joint, axis in enumerate(rig.axes)
    )


def _by_speed(speed: Array) -> list[tuple[str, NDArray[np.bool_]]]:
    share = np.abs(speed) / max(float(np.abs(speed).max()), 1e-12)
    return [
        (f"below {100 * SLOW:.0f} % of the top speed", share < SLOW),
        (f"{100 * SLOW:.0f} to {100 * FAST:.0f} %", (share >= SLOW) & (share < FAST)),
        (f"above {100 * FAST:.0f} %", share >= FAST),
    ]


def _by_quadrant(speed: Array, load: Array) -> list[tuple[str, NDArray[np.bool_]]]:
    return [("driving its load", speed * load > 0), ("driven by its load", speed * load < 0)]


def _parts(
    listed: list[tuple[str, NDArray[np.bool_]]], before: Array, after: Array
) -> tuple[FollowingPart, ...]:
    return tuple(
        FollowingPart(
            where=label, samples=int(rows.sum()), rms_without=_rms(before[rows]), rms_with=_rms(after[rows])
        )
        for label, rows in listed
        if rows.any()
    )


def _rms(values: Array) -> float:
    return float(np.sqrt(np.nanmean(values**2)))
