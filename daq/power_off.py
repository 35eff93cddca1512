"""No power: taken by every means there is, and believed only when it is read back.

`PowerCut` is what remains when a quick stop does not do what it should. In this order: the safety output, where the rig
file names one; DISABLE VOLTAGE to every drive by RPDO and by SDO, without waiting for an answer; for a drive that does not
then say that it has no power, NMT stop and reset, after which it boots without. What is still not confirmed is told at
once: press the emergency stop.
"""

import threading
import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

from daq.rig import Rig
from drivers.cia402 import State, state_of
from drivers.drive import Drive
from drivers.errors import BusError, DriverError
from drivers.safety_output import SafetyOutput

OFF = frozenset(
    {State.NOT_READY_TO_SWITCH_ON, State.SWITCH_ON_DISABLED, State.READY_TO_SWITCH_ON, State.FAULT}
)
"""states in which a drive's power stage gives no torque"""
EMERGENCY_STOP = "press the emergency stop"

_ANSWER = 0.05
"""s for a drive to say its state, once power must go"""
_BOOT = 3.0
"""s from NMT reset to boot-up"""
_AT_REST_GAP = 0.05
"""s between two positions that tell whether an axis stands"""
_REST_SHARE = 0.02
"""of the velocity limit: slower than that between those two, an axis rests"""


@dataclass(frozen=True)
class AxisPower:
    """What a drive said last.

    off   : read back; False where it has power, or does not say
    rests : whether it stands still; None where it is not known
    words : what was seen
    """

    joint: str
    node: int
    off: bool
    rests: bool | None
    words: str


@dataclass(frozen=True)
class PowerReport:
    """Every axis after the end of a motion."""

    axes: tuple[AxisPower, ...]

    @property
    def off(self) -> bool:
        """Whether every drive was read back without power."""
        return all(axis.off for axis in self.axes)

    @property
    def alarm(self) -> str:
        """What a person must do now; empty where every axis has no power and rests, as far as is known."""
        on = [axis for axis in self.axes if not axis.off]
        moving = [axis for axis in self.axes if axis.off and axis.rests is False]
        parts: list[str] = []
        if on:
            listed = "; ".join(f"joint {axis.joint} (node {axis.node}): {axis.words}" for axis in on)
            parts.append(f"power could not be read back as off ({listed}): {EMERGENCY_STOP}")
        if moving:
            joints = ", ".join(axis.joint for axis in moving)
            parts.append(f"joint {joints} still moves, without power: keep clear, {EMERGENCY_STOP}")
        return "; ".join(parts)


def read_power(rig: Rig, drives: Sequence[Drive], quickly: bool = True) -> PowerReport:
    """Ask every drive for its state and, twice, where it stands; nothing is written."""
    patience = (_ANSWER, 1) if quickly else (0.3, 2)
    states = [_state(drive, *patience) for drive in drives]
    first = [_position(drive, _ANSWER) for drive in drives]
    # In simulated time nothing moves while we look.
    known = rig.pacing == "real-time" and all(position is not None for position in first)
    rests: list[bool | None] = [None] * len(drives)
    if known:
        begun = time.monotonic()
        threading.Event().wait(_AT_REST_GAP)
        second = [_position(drive, _ANSWER) for drive in drives]
        if all(position is not None for position in second):
            passed = time.monotonic() - begun
            counts = np.array(second, float) - np.array(first, float)
            resolution = 4 * np.abs(rig.position_matrix).sum(axis=1)
            way = np.abs(rig.position_matrix @ counts)
            limit = np.array([axis.limits.velocity for axis in rig.axes]) * _REST_SHARE * passed + resolution
            rests = [bool(each) for each in way <= limit]
    return PowerReport(
        tuple(
            AxisPower(axis.joint, axis.node, state in OFF, rest, answer)
            for axis, (state, answer), rest in zip(rig.axes, states, rests, strict=True)
        )
    )


def _state(drive: Drive, timeout: float, retries: int) -> tuple[State | None, str]:
    try:
        with drive.sdo.hurried(timeout, retries):
            word = drive.statusword()
    except DriverError:
        return None, "it does not answer"
    try:
        state = state_of(word)
    except ValueError as error:
        return None, str(error)
    return state, f"it is in {state.words}"


def _wait_for_boot_up(drive: Drive, boot_ups: int) -> None:
    drive.watch.wait_for(lambda: drive.watch.boot_ups > boot_ups, 0.1)


def _position(drive: Drive, timeout: float) -> int | None:
    try:
        with drive.sdo.hurried(timeout, 0):
            return drive.position()
    except DriverError:
        return None


class PowerCut:
    """Takes the power of all axes, in a thread of its own, so that samples go on being taken.

    by_rpdo : sends DISABLE VOLTAGE by RPDO to every drive
    tell    : called once with words, as soon as it is clear that a drive may still have power
    """

    def __init__(
        self,
        rig: Rig,
        drives: Sequence[Drive],
        output: SafetyOutput | None,
        by_rpdo: Callable[[], None],
        tell: Callable[[str], None],
    ) -> None:
        self._rig = rig
        self._drives = list(drives)
        self._output = output
        self._by_rpdo = by_rpdo
        self._tell = tell
        self._thread = threading.Thread(target=self._run, name="power-cut", daemon=True)
        self.refusals: list[str] = []
        """means that failed, in words"""

    def start(self) -> None:
        """Cut. Returns at once."""
        self._thread.start()

    @property
    def done(self) -> bool:
        """Whether every means has been tried."""
        return not self._thread.is_alive()

    def wait(self) -> None:
        """Wait until every means has been tried."""
        self._thread.join()

    def _run(self) -> None:
        if self._output is not None:
            self._try(self._output.cut)
        self._try(self._by_rpdo)
        for drive in self._drives:
            self._try(drive.disable_at_once)
        left = [drive for drive in self._drives if not self._is_off(drive)]
        if not left:
            return
        before = {drive.node: drive.watch.boot_ups for drive in left}
        for drive in left:
            self._try(drive.reset_at_once)
        latest = time.monotonic() + _BOOT
        reported = False
        while left:
            left = [drive for drive in left if not self._is_off_or_booted(drive, before[drive.node])]
            if left and not reported:
                reported = True
                joints = ", ".join(self._joint(drive.node) for drive in left)
                self._tell(f"{joints} may still have power: {EMERGENCY_STOP}")
            if not left or time.monotonic() >= latest:
                return
            self._try(self._by_rpdo)
            _wait_for_boot_up(left[0], before[left[0].node])

    def _is_off_or_booted(self, drive: Drive, boot_ups: int) -> bool:
        return drive.watch.boot_ups > boot_ups or self._is_off(drive)

    def _is_off(self, drive: Drive) -> bool:
        state, _ = _state(drive, _ANSWER, 0)
        return state in OFF

    def _joint(self, node: int) -> str:
        return next(f"joint {axis.joint} (node {node})" for axis in self._rig.axes if axis.node == node)

    def _try(self, means: Callable[[], None]) -> None:
        try:
            means()
        except BusError as error:
            self.refusals.append(str(error))
