"""Feedforward torque of a motion, as the drives take it: object 0x60B2 beside the target, at every SYNC."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from daq.rig import Rig
from daq.torque_loop import TorqueLoop
from drivers.process_data import TARGET_TORQUE, TORQUE_OFFSET
from identify.recording.errors import InputError

RAMP = 0.5
"""s in which the torque is faded in where a plan begins, and out where it ends"""


@dataclass(frozen=True)
class TorqueOffset:
    """What is sent in each cycle of a plan.

    counts  : (L, n) int16, per mille of the rated torque
    largest : (n,) A, magnitude
    bounded : (n,) part of the cycles in which the share of the current limit was less than the torque asked for
    """

    counts: NDArray[np.int16]
    largest: NDArray[np.float64]
    bounded: NDArray[np.float64]


@dataclass(frozen=True)
class SentAhead:
    """What a session sends beside its setpoints, and how closely the axes must follow meanwhile.

    counts         : (L, n) int16, per mille of the rated torque, a row for each cycle of the plan
    follows_within : (n,) rad or m: the motion is stopped where a position is further than this from the setpoint of the SYNC
                     before, at which the axis should have arrived
    loop           : the position loop that this computer closes in mode 10, the counts being added to its torque; None where the
                     drives' own loops hold the axes and take the counts as torque offset
    without        : (L, n) rad or m: following error of the same plan without torque, NaN where it is not known; the motion is
                     stopped where the torque makes it clearly worse (`daq.following_watch`)
    """

    counts: NDArray[np.int16]
    follows_within: NDArray[np.float64]
    without: NDArray[np.float64]
    loop: TorqueLoop | None = None

    @property
    def entry(self) -> str:
        """The torque that goes beside a target position, by its name in the drives' setpoints."""
        return TORQUE_OFFSET if self.loop is None else TARGET_TORQUE


def torque_offset(rig: Rig, torque: NDArray[np.float64], share: float, *, faded: bool = True) -> TorqueOffset:
    """Joint torques (L, n), N m or N, as torque offsets: bounded, faded in and out, in the drives' unit.

    share : of each axis's current limit, 0 to 1
    faded : False where the loop that holds the axes is ours, whose integral gives the torque at the beginning and takes it over
        at the end

    Raises InputError: the rig file does not say what a drive's rated torque is, or a torque is not a number.
    """
    if not 0.0 < share <= 1.0:
        raise InputError(f"--share {share:g}: must be above 0 and at most 1, a part of the current limit")
    if not np.isfinite(torque).all():
        row, axis = (int(place[0]) for place in np.nonzero(~np.isfinite(torque)))
        raise InputError(
            f"{rig.axes[axis].joint}: the torque asked for {row * rig.cycle:.3g} s into the plan is not a number; nothing is sent"
        )
    current = np.linalg.solve(rig.drive_gain, torque.T).T
    limit = share * np.array([axis.limits.current for axis in rig.axes])
    within = np.clip(current, -limit, limit)
    sent = within * fading(len(torque), rig.cycle)[:, None] if faded else within
    counts = np.rint(sent * per_mille(rig))
    most = np.iinfo(np.int16).max
    if np.abs(counts).max(initial=0.0) > most:
        raise InputError(
            f"rig {rig.name}: the torque asked for is more than 0x60B2 holds; look at the rated torque"
        )
    return TorqueOffset(
        counts.astype(np.int16), np.abs(sent).max(axis=0), np.mean(np.abs(current) > limit, axis=0)
    )


def fading(cycles: int, period: float) -> NDArray[np.float64]:
    """(cycles,) share of the torque that is sent: it grows from 0 where a plan begins, and falls to 0 where it ends."""
    count = np.arange(cycles)
    return np.clip(np.minimum(count, count[::-1]) * period / RAMP, 0.0, 1.0)


def per_mille(rig: Rig) -> NDArray[np.float64]:
    """(n,) per mille of the rated torque for each A of command."""
    factors: list[float] = []
    for axis, profile in zip(rig.axes, rig.profiles, strict=True):
        if axis.rated_torque is not None:
            of_one = axis.torque_constant / axis.rated_torque
        elif axis.rated_current is not None:
            of_one = 1.0 / axis.rated_current
        else:
            raise InputError(
                f"rig {rig.name}: axis {axis.joint}: rated_torque or rated_current is needed, for 0x60B2 is in per mille of it"
            )
        factors.append(1000.0 * of_one * profile.current_reference.sign)
    return np.array(factors)
