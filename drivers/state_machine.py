"""The CiA 402 state machine of a drive as its master walks it, every step verified against the drive.

Nothing is remembered: the state is read from 0x6041 and the mode from 0x6061 each time, each wait has a stated
end, and a failure says which node, which object, what was expected and what came.
"""

import time
from collections.abc import Callable
from dataclasses import dataclass
from typing import TypeVar

from drivers import cia402
from drivers.canopen_network import NodeWatch
from drivers.cia402 import Command, Mode, State
from drivers.emergency import code_in_words, register_in_words
from drivers.errors import DriveError
from drivers.process_data import is_missing
from drivers.sdo import SdoAccess

T = TypeVar("T")

_VELOCITY = 0x606C
NO_MODE_DISPLAY = "has no mode display (0x6061): that it is in the mode asked for cannot be read back"


@dataclass(frozen=True)
class Timeouts:
    """How long to wait, s, and how often to ask again.

    sdo        : each SDO answer
    retries    : repetitions of an SDO request without answer
    transition : each step of the state machine, e.g. until the brake is released
    mode       : until 0x6061 shows the mode asked for, where the drive has it
    nmt        : until a heartbeat shows the NMT state asked for
    boot       : from NMT reset to boot-up
    quick_stop : until the axis has stopped
    homing     : until homing is attained
    poll       : between two questions of a wait
    """

    sdo: float = 0.3
    retries: int = 2
    transition: float = 2.0
    mode: float = 1.0
    nmt: float = 1.0
    boot: float = 5.0
    quick_stop: float = 5.0
    homing: float = 60.0
    poll: float = 0.002


DEFAULT_TIMEOUTS = Timeouts()


class StateMachine:
    """States and modes of one drive.

    node     : its CANopen node id
    sdo      : SDO of that node
    watch    : its heartbeat and EMCY
    timeouts : how long each step may take
    """

    def __init__(self, node: int, sdo: SdoAccess, watch: NodeWatch, timeouts: Timeouts):
        self.node = node
        self.sdo = sdo
        self.watch = watch
        self.timeouts = timeouts

    def statusword(self) -> int:
        """0x6041, read now."""
        return self.sdo.read(cia402.STATUSWORD, 0, "uint16", "reading the statusword")

    def state(self) -> State:
        """The state that the statusword shows now."""
        return cia402.state_of(self.statusword())

    def mode(self) -> int | None:
        """0x6061, the mode in which the drive is now; None where it does not tell."""
        try:
            return self.sdo.read(cia402.MODE_OF_OPERATION_DISPLAY, 0, "int8", "reading the mode")
        except DriveError as refusal:
            if is_missing(refusal):
                return None
            raise

    def error_in_words(self) -> str:
        """Error code 0x603F, error register 0x1001 and the last EMCY, for an operator."""
        parts: list[str] = []
        try:
            code = self.sdo.read(cia402.ERROR_CODE, 0, "uint16")
            if code:
                parts.append(code_in_words(code))
        except DriveError:
            parts.append("the error code 0x603F cannot be read")
        try:
            register = self.sdo.read(0x1001, 0, "uint8")
            if register:
                parts.append(f"error register: {register_in_words(register)}")
        except DriveError:
            parts.append("the error register 0x1001 cannot be read")
        if self.watch.emergencies and not self.watch.emergencies[-1].is_reset:
            parts.append(f"last EMCY {code_in_words(self.watch.emergencies[-1].code)}")
        return "; ".join(parts) or "the drive reports no error"

    def set_mode(self, mode: Mode) -> None:
        """Switch the mode of operation and wait until 0x6061 shows it; a drive that has no such object is believed.

        Raises DriveError when the drive does not support the mode, refuses it or does not show it in time.
        """
        supported = self._supported_modes()
        # One that shows none at all says nothing: 0x6061 decides.
        if supported and not supported >> (mode - 1) & 1:
            raise DriveError(
                self.node,
                f"switching to {mode.words} (mode {int(mode)})",
                index=cia402.SUPPORTED_DRIVE_MODES,
                expected=f"bit {mode - 1}",
                received=f"0x{supported:08X} came: the drive does not support this mode",
            )
        self.sdo.write(cia402.MODE_OF_OPERATION, 0, "int8", int(mode), f"switching to {mode.words}")
        shown = self._wait(self.mode, lambda seen: seen in (mode, None), self.timeouts.mode)
        if shown not in (mode, None):
            raise DriveError(
                self.node,
                f"switching to {mode.words}",
                index=cia402.MODE_OF_OPERATION_DISPLAY,
                expected=f"mode {int(mode)} within {self.timeouts.mode:g} s",
                received=f"the drive stays in mode {shown}",
            )

    def _supported_modes(self) -> int | None:
        try:
            return self.sdo.read(cia402.SUPPORTED_DRIVE_MODES, 0, "uint32")
        except DriveError:
            return None

    def enable(self) -> None:
        """Go to OPERATION ENABLED, step by step, each step confirmed by the statusword.

        Raises DriveError that says in which state the drive stays, and why as far as it tells. A drive in
        FAULT is not reset here: that is the operator's decision (`reset_fault`).
        """
        while True:
            state = self._settled_state()
            if state is State.OPERATION_ENABLED:
                return
            if state is State.FAULT:
                raise DriveError(
                    self.node,
                    "enabling the drive",
                    index=cia402.STATUSWORD,
                    expected=State.OPERATION_ENABLED.words,
                    received=f"the drive is in FAULT: {self.error_in_words()}",
                )
            command, following = cia402.TOWARDS_OPERATION_ENABLED[state]
            self._command(command, following, self.timeouts.transition, "enabling the drive")

    def disable(self) -> None:
        """Go to SWITCH ON DISABLED (no torque) from any state but a fault."""
        state = self._settled_state()
        if state not in (State.SWITCH_ON_DISABLED, State.FAULT):
            self._command(
                Command.DISABLE_VOLTAGE,
                State.SWITCH_ON_DISABLED,
                self.timeouts.transition,
                "disabling the drive",
            )

    def quick_stop(self) -> None:
        """Stop along the quick stop ramp and wait until the axis rests.

        By 0x605A the drive then goes to SWITCH ON DISABLED by itself, or holds in QUICK STOP ACTIVE. Does
        nothing when the drive is not in OPERATION ENABLED.

        Raises DriveError when the axis does not come to rest in time.
        """
        if self._settled_state() is not State.OPERATION_ENABLED:
            return
        self.sdo.write(cia402.CONTROLWORD, 0, "uint16", Command.QUICK_STOP.value, "quick stop")
        timeout = self.timeouts.quick_stop
        state = self._wait(self.state, lambda seen: seen is not State.OPERATION_ENABLED, timeout)
        holds = state is State.QUICK_STOP_ACTIVE and self._holds_after_quick_stop()
        if holds:
            velocity = self._wait(self._velocity, lambda seen: seen == 0, timeout)
            if velocity:
                raise DriveError(
                    self.node,
                    "quick stop",
                    index=_VELOCITY,
                    expected=f"velocity 0 within {timeout:g} s",
                    received=f"{velocity} came",
                )
            return
        stopped = (State.SWITCH_ON_DISABLED, State.FAULT)
        state = self._wait(self.state, lambda seen: seen in stopped, timeout)
        if state not in stopped:
            raise self._stuck("quick stop", State.SWITCH_ON_DISABLED, state, timeout)

    def _holds_after_quick_stop(self) -> bool:
        try:
            option = self.sdo.read(cia402.QUICK_STOP_OPTION, 0, "int16", "reading the quick stop option")
        except DriveError:
            return False  # optional object; its default, 2, does not hold
        return option >= 5

    def _velocity(self) -> int:
        return self.sdo.read(_VELOCITY, 0, "int32", "reading the velocity")

    def reset_fault(self) -> None:
        """Reset a fault by a rising edge of controlword bit 7; harmless when there is none.

        Raises DriveError, with the drive's reason, when the fault stays.
        """
        if self._settled_state() is not State.FAULT:
            return
        self.sdo.write(cia402.CONTROLWORD, 0, "uint16", 0, "fault reset")
        self.sdo.write(cia402.CONTROLWORD, 0, "uint16", Command.FAULT_RESET.value, "fault reset")
        state = self._wait(self.state, lambda seen: seen is not State.FAULT, self.timeouts.transition)
        self.sdo.write(cia402.CONTROLWORD, 0, "uint16", 0, "fault reset")
        if state is State.FAULT:
            raise self._stuck("fault reset", State.SWITCH_ON_DISABLED, state, self.timeouts.transition)

    def home(self, method: int | None = None, stopped: Callable[[], bool] = lambda: False) -> None:
        """Run the drive's homing (mode 6) and wait until it is attained; the drive must be enabled.

        method  : 0x6098; None leaves the drive's own
        stopped : whether somebody stopped it meanwhile; asked from before the start on

        Raises DriveError when the drive reports a homing error, does not finish in time, or was stopped; the axis may
        still move then.
        """

        def unless_stopped() -> None:
            if stopped():
                raise DriveError(self.node, "homing", received="it was stopped")

        unless_stopped()
        if method is not None:
            self.sdo.write_verified(0x6098, 0, "int8", method, "setting the homing method")
        self.set_mode(Mode.HOMING)
        self.enable()
        enabled = Command.ENABLE_OPERATION.value
        self.sdo.write(cia402.CONTROLWORD, 0, "uint16", enabled, "homing")
        unless_stopped()
        self.sdo.write(cia402.CONTROLWORD, 0, "uint16", enabled | cia402.START_HOMING, "homing")
        attained = cia402.HOMING_ATTAINED | cia402.TARGET_REACHED

        def finished(word: int) -> bool:
            at_end = word & attained == attained or word & cia402.HOMING_ERROR
            return bool(at_end) or stopped() or cia402.state_of(word) is not State.OPERATION_ENABLED

        word = self._wait(self.statusword, finished, self.timeouts.homing)
        unless_stopped()
        if word & cia402.HOMING_ERROR or word & attained != attained:
            raise DriveError(
                self.node,
                "homing",
                index=cia402.STATUSWORD,
                expected=f"homing attained within {self.timeouts.homing:g} s",
                received=f"statusword 0x{word:04X}: {self.error_in_words()}",
            )
        self.sdo.write(cia402.CONTROLWORD, 0, "uint16", enabled, "homing")

    # ---- the waits behind the steps ----

    def _settled_state(self) -> State:
        """The state once the drive is neither starting nor reacting to a fault."""
        passing = (State.NOT_READY_TO_SWITCH_ON, State.FAULT_REACTION_ACTIVE)
        state = self._wait(self.state, lambda seen: seen not in passing, self.timeouts.transition)
        if state in passing:
            raise self._stuck(
                "waiting for the drive", State.SWITCH_ON_DISABLED, state, self.timeouts.transition
            )
        return state

    def _command(self, command: Command, following: State, timeout: float, doing: str) -> None:
        self.sdo.write(cia402.CONTROLWORD, 0, "uint16", command.value, doing)
        ends = (following, State.FAULT)
        state = self._wait(self.state, lambda seen: seen in ends, timeout)
        if state is not following:
            raise self._stuck(doing, following, state, timeout)

    def _stuck(self, doing: str, wanted: State, state: State, timeout: float) -> DriveError:
        word = self.statusword()
        reasons = [self.error_in_words()]
        if not word & cia402.VOLTAGE_ENABLED:
            reasons.append("no voltage at the power stage (statusword bit 4)")
        if not word & cia402.REMOTE:
            reasons.append("the drive does not take commands from the bus (statusword bit 9, remote)")
        return DriveError(
            self.node,
            doing,
            index=cia402.STATUSWORD,
            expected=f"{wanted.words} within {timeout:g} s",
            received=f"the drive is in {state.words} (0x{word:04X}): {'; '.join(reasons)}",
        )

    def _wait(self, ask: Callable[[], T], enough: Callable[[T], object], timeout: float) -> T:
        """Ask until the answer is enough or `timeout` s have passed; the last answer."""
        end = time.monotonic() + timeout
        while True:
            answer = ask()
            if enough(answer) or time.monotonic() >= end:
                return answer
            time.sleep(self.timeouts.poll)
