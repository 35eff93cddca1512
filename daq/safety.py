"""Why a motion ends, and the limits that end it.

The plan is checked before anything moves; here every sample is checked while it moves. What has not come is not
checked and not filled in: a drive that stays silent is a reason of its own.
"""

from dataclasses import dataclass, replace
from enum import StrEnum
from typing import Any

import numpy as np
from numpy.typing import NDArray

from daq.derivative_limits import DerivativeLimits, Excess, excess_in_words
from daq.following_watch import FollowingWatch
from daq.rig import Rig
from daq.samples import (
    CAME_AGAIN,
    CAME_LATE,
    COMMAND_CAME,
    POSITION_CAME,
    SYNC_NOT_SEEN,
    Phase,
    joint_positions,
)
from daq.standing_position import StandingPosition
from daq.torque_offset import SentAhead
from drivers.cia402 import State, state_of

_ROUNDING = 1.0 + 1e-9
"""a drive at its own limit, which is the rig's, is not beyond it by a rounding of ours"""


class StopCause(StrEnum):
    """Every way in which a motion can end."""

    PLAN_DONE = "plan done"
    OPERATOR = "operator's stop"
    DEAD_PARENT = "the supervising process is gone"
    LIMIT = "limit"
    DRIVE_FAULT = "drive fault"
    EMERGENCY = "EMCY"
    RESTARTED = "drive restarted"
    LOST_HEARTBEAT = "lost heartbeat"
    SILENT_DRIVE = "silent drive"
    LOST_SYNC = "lost SYNC"
    LOST_FRAMES = "lost frames"
    FULL_DISK = "full disk"
    RECORDER = "recorder"
    BUS = "bus"
    FOREIGN_MASTER = "another master"
    HELD_UP = "this computer was held up"
    POWER_NOT_OFF = "power not read back as off"
    DATA_IN_DOUBT = "data in doubt"
    INTERNAL = "internal error"

    @property
    def status(self) -> str:
        """The recording's status after this: `complete`, `aborted` (somebody's decision) or `faulted`."""
        if self is StopCause.PLAN_DONE:
            return "complete"
        return "aborted" if self in (StopCause.OPERATOR, StopCause.DEAD_PARENT) else "faulted"


@dataclass(frozen=True)
class StopReason:
    """Why a motion ended: the cause, and one sentence for the operator.

    unseen : the joint whose position is not to be believed, so that nobody sees whether it stops; empty where there is none
    """

    cause: StopCause
    words: str
    unseen: str = ""

    @property
    def status(self) -> str:
        """The recording's status: `complete`, `aborted` or `faulted`."""
        return self.cause.status


class LimitMonitor:
    """Checks rows of samples against the rig's limits; keeps what derivatives need from one block to the next.

    Velocity and acceleration, being differences, are judged with what they magnify in mind: `derivative_limits.py`.
    """

    def __init__(self, rig: Rig, ahead: SentAhead | None = None) -> None:
        """ahead : the torque that is sent beside the setpoints, and how the axes must follow meanwhile"""
        self.rig = rig
        self._following_watch = None if ahead is None else FollowingWatch(rig, ahead)
        supervision = rig.supervision
        limits = [axis.limits for axis in rig.axes]
        n = len(limits)
        self._names = [axis.joint for axis in rig.axes]
        self._units = ["m" if joint.type == "prismatic" else "rad" for joint in rig.robot.joints]
        self._matrix, self._offset = rig.position_matrix, rig.position_offset
        self._ampere = rig.command_scale
        following = np.array([limit.following_error for limit in limits])
        position = np.array([limit.position for limit in limits])
        # The setpoints are within the limits; the axis may deviate from them by the following error.
        self._lowest, self._highest = position[:, 0] - following, position[:, 1] + following
        self._following = following
        self._derivatives = DerivativeLimits(rig)
        self._standing = StandingPosition(rig)
        self._current = np.array([limit.current for limit in limits])
        self._temperature = np.array([limit.temperature or np.inf for limit in limits])
        self._silent = max(1, round(supervision.silence / rig.cycle))
        self._silent_for = np.zeros(n, int)
        self._sync_lost_for = 0

    def check(self, rows: NDArray[Any]) -> StopReason | None:
        """The earliest violation in these rows (M,) of `sample_dtype`, or None.

        To be fed every row in order; rows at standstill count for the derivatives but are not judged.
        """
        if not len(rows):
            return None
        counted = rows["cycle"] * self.rig.cycle
        # Behind simulated drives time passes with SYNC, in whatever rhythm it comes.
        stamped = counted if self.rig.simulated is not None else rows["sync_time"] * 1e-9
        came = (rows["valid"] & POSITION_CAME) != 0
        position = joint_positions(rows["position"], rows["valid"], self._matrix, self._offset)
        again = (rows["valid"] & CAME_AGAIN) != 0
        late = (rows["valid"] & CAME_LATE) != 0
        moving = rows["phase"] != Phase.STANDSTILL
        mask, pattern = State.OPERATION_ENABLED.value
        held = ~moving & (((rows["status"] & mask) == pattern) & came).any(axis=1)
        following = (rows["phase"] == Phase.PLAN) | (rows["phase"] == Phase.APPROACH)
        current = np.abs(rows["command"] * self._ampere)
        commanded = (rows["valid"] & COMMAND_CAME) != 0

        excesses = [
            self._beyond_position(position, moving | held),
            *self._derivatives.check(
                np.column_stack([counted, stamped]), position, ~came | late, again, moving, held
            ),
            self._beyond_following(rows, position, following),
            self._standing.check(rows, came, following, held, np.where(commanded, current, 0.0)),
            *(() if self._following_watch is None else self._following_watch.check(rows, position)),
            self._beyond_current(current, commanded, moving),
            self._beyond_temperature(rows, moving),
        ]
        reasons = [(item.row, self._reason(item)) for item in excesses if item is not None]
        reasons += self._not_enabled(rows, came, following)
        reasons += self._silence(came, following)
        reasons += self._lost_sync(rows, moving)
        if not reasons:
            return None
        row, reason = min(reasons, key=lambda pair: pair[0])
        return replace(reason, words=f"{reason.words} in cycle {int(rows['cycle'][row])}")

    def _reason(self, excess: Excess) -> StopReason:
        joint = self._names[excess.axis]
        return StopReason(StopCause.LIMIT, f"joint {joint}: {excess.words}", joint if excess.unseen else "")

    def _first(self, bad: NDArray[np.bool_]) -> tuple[int, int] | None:
        """Row and axis of the first true entry of (M, n)."""
        return divmod(int(bad.argmax()), bad.shape[1]) if bad.any() else None

    def _beyond_position(self, position: NDArray[Any], moving: NDArray[Any]) -> Excess | None:
        at = self._first(((position < self._lowest) | (position > self._highest)) & moving[:, None])
        if at is None:
            return None
        axis, unit = at[1], self._units[at[1]]
        lowest, highest = self.rig.axes[axis].limits.position
        return Excess(*at, f"position {position[at]:.4g} {unit} outside {lowest:g} to {highest:g} {unit}")

    def _beyond_following(
        self, rows: NDArray[Any], position: NDArray[Any], following: NDArray[Any]
    ) -> Excess | None:
        wanted = rows["setpoint"] @ self._matrix.T + self._offset
        error = np.abs(wanted - position)
        with np.errstate(invalid="ignore"):
            at = self._first((error > self._following) & following[:, None])
        if at is None:
            return None
        unit = self._units[at[1]]
        return Excess(*at, f"following error {excess_in_words(error[at], self._following[at[1]], unit)}")

    def _beyond_current(
        self, current: NDArray[Any], commanded: NDArray[Any], moving: NDArray[Any]
    ) -> Excess | None:
        at = self._first((current > self._current * _ROUNDING) & commanded & moving[:, None])
        if at is None:
            return None
        return Excess(*at, f"current {excess_in_words(current[at], self._current[at[1]], 'A')}")

    def _beyond_temperature(self, rows: NDArray[Any], moving: NDArray[Any]) -> Excess | None:
        with np.errstate(invalid="ignore"):
            at = self._first((rows["temperature"] > self._temperature) & moving[:, None])
        if at is None:
            return None
        hot = float(rows["temperature"][at])
        return Excess(*at, f"temperature {hot:.1f} °C above {self._temperature[at[1]]:g} °C")

    def _not_enabled(
        self, rows: NDArray[Any], came: NDArray[Any], following: NDArray[Any]
    ) -> list[tuple[int, StopReason]]:
        mask, pattern = State.OPERATION_ENABLED.value
        at = self._first(((rows["status"] & mask) != pattern) & came & following[:, None])
        if at is None:
            return []
        word = int(rows["status"][at])
        try:
            state = state_of(word).words
        except ValueError:
            state = f"statusword 0x{word:04X}"
        sentence = f"joint {self._names[at[1]]}: the drive left OPERATION ENABLED; it is in {state}"
        return [(at[0], StopReason(StopCause.DRIVE_FAULT, sentence))]

    def _silence(self, came: NDArray[Any], following: NDArray[Any]) -> list[tuple[int, StopReason]]:
        reasons: list[tuple[int, StopReason]] = []
        if not (~came & following[:, None]).any():
            self._silent_for[:] = 0
            return reasons
        for axis, name in enumerate(self._names):
            silent = ~came[:, axis] & following
            run = _running_length(silent, int(self._silent_for[axis]))
            self._silent_for[axis] = run[-1]
            too_long = np.flatnonzero(run >= self._silent)
            if len(too_long):
                lasting = self._silent * self.rig.cycle
                sentence = f"joint {name}: no position from the drive for {lasting:g} s"
                reasons.append((int(too_long[0]), StopReason(StopCause.SILENT_DRIVE, sentence)))
        return reasons

    def _lost_sync(self, rows: NDArray[Any], moving: NDArray[Any]) -> list[tuple[int, StopReason]]:
        lost = ((rows["valid"] & SYNC_NOT_SEEN) != 0).any(axis=1) & moving
        if not lost.any():
            self._sync_lost_for = 0
            return []
        run = _running_length(lost, self._sync_lost_for)
        self._sync_lost_for = int(run[-1])
        too_long = np.flatnonzero(run >= self._silent)
        if not len(too_long):
            return []
        sentence = f"no SYNC was seen on the bus for {self._silent * self.rig.cycle:g} s"
        return [(int(too_long[0]), StopReason(StopCause.LOST_SYNC, sentence))]


def _running_length(true: NDArray[np.bool_], before: int) -> NDArray[np.int64]:
    """(M,) how many trues in a row end here, `before` having come before the first."""
    index = np.arange(1, len(true) + 1)
    last_false = np.maximum.accumulate(np.where(true, -before, index))
    return np.where(true, index - last_false, 0)
