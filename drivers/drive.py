"""A CiA 402 drive on canopen, every step verified against what the drive itself says.

canopen's own CiA 402 node caches the statusword, returns silently from a failed mode switch and only logs
what fails in a callback. Here nothing is believed: the state is read from 0x6041 and the mode from 0x6061
each time, each wait has a stated end, and a failure says which node, which object, what was expected and
what came.
"""

import time
from collections.abc import Callable
from dataclasses import dataclass
from typing import TypeVar

from drivers import cia402
from drivers.canopen_network import CanopenNetwork, nmt_state_in_words
from drivers.cia402 import Command, Mode, State
from drivers.emergency import Emergency, code_in_words, register_in_words
from drivers.errors import DriveError
from drivers.object_dictionary import load_object_dictionary
from drivers.process_data import (
    SYNCHRONOUS,
    DriveStream,
    MappedEntry,
    distribute,
    switch_off_pdo,
    write_pdo,
)
from drivers.profile import GENERIC, DriveProfile
from drivers.sdo import SdoAccess

T = TypeVar("T")

_PRODUCER_HEARTBEAT = 0x1017
_CONSUMER_HEARTBEAT = 0x1016
_NMT_COMMANDS = {"OPERATIONAL": (1, 5), "STOPPED": (2, 4), "PRE-OPERATIONAL": (128, 127)}
_NMT_RESET_NODE = 129
_VELOCITY = 0x606C

# COB-IDs of the predefined connection set, CiA 301 section 7.3.3.
_TPDO_BASE = (0x180, 0x280, 0x380, 0x480)
_RPDO_BASE = (0x200, 0x300, 0x400, 0x500)

# Target object of each cyclic mode: index, subindex, NumPy's type.
_TARGETS = {
    Mode.CYCLIC_SYNCHRONOUS_POSITION: (0x607A, 0, "<i4"),
    Mode.CYCLIC_SYNCHRONOUS_VELOCITY: (0x60FF, 0, "<i4"),
    Mode.CYCLIC_SYNCHRONOUS_TORQUE: (0x6071, 0, "<i2"),
    Mode.INTERPOLATED_POSITION: (0x60C1, 1, "<i4"),
}


@dataclass(frozen=True)
class Timeouts:
    """How long to wait, s, and how often to ask again.

    sdo        : each SDO answer
    retries    : repetitions of an SDO request without answer
    transition : each step of the state machine, e.g. until the brake is released
    mode       : until 0x6061 shows the mode asked for
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


@dataclass(frozen=True)
class Identity:
    """Objects 0x1018 and 0x1000 of a node."""

    vendor: int
    product: int
    revision: int
    serial: int
    device_type: int

    @property
    def profile(self) -> int:
        """Device profile number, 402 for a drive."""
        return self.device_type & 0xFFFF


class Drive:
    """One drive on a network.

    network  : the CanopenNetwork it is on
    node     : its CANopen node id, 1 to 127
    profile  : which objects carry position and current reference
    timeouts : how long each step may take
    """

    def __init__(
        self,
        network: CanopenNetwork,
        node: int,
        profile: DriveProfile = GENERIC,
        timeouts: Timeouts = Timeouts(),
    ):
        if not 1 <= node <= 127:
            raise ValueError(f"a CANopen node id lies between 1 and 127, not {node}")
        self.network = network
        self.node = node
        self.profile = profile
        self.timeouts = timeouts
        self.watch = network.watch(node)
        remote = network.add_node(node, load_object_dictionary(profile.object_dictionary, node))
        self.sdo = SdoAccess(node, remote, timeouts.sdo, timeouts.retries)

    # ---- who it is and how it is ----

    def identity(self) -> Identity:
        """Identity and device type, read now.

        Raises DriveError when the node does not answer, or is not of the profile's vendor.
        """
        read = self.sdo.read
        identity = Identity(
            read(0x1018, 1, "uint32", "reading the vendor"),
            self._optional(0x1018, 2),
            self._optional(0x1018, 3),
            self._optional(0x1018, 4),
            read(0x1000, 0, "uint32", "reading the device type"),
        )
        if self.profile.vendor_id is not None and identity.vendor != self.profile.vendor_id:
            raise DriveError(
                self.node,
                f"checking that it fits the profile {self.profile.name}",
                index=0x1018,
                subindex=1,
                expected=f"vendor 0x{self.profile.vendor_id:08X}",
                received=f"0x{identity.vendor:08X} came",
            )
        return identity

    def _optional(self, index: int, subindex: int) -> int:
        try:
            return self.sdo.read(index, subindex, "uint32")
        except DriveError:
            return 0

    def statusword(self) -> int:
        """0x6041, read now."""
        return self.sdo.read(cia402.STATUSWORD, 0, "uint16", "reading the statusword")

    def state(self) -> State:
        """The state that the statusword shows now."""
        return cia402.state_of(self.statusword())

    def mode(self) -> int:
        """0x6061, the mode in which the drive is now."""
        return self.sdo.read(cia402.MODE_OF_OPERATION_DISPLAY, 0, "int8", "reading the mode")

    def error_in_words(self) -> str:
        """Error code 0x603F, error register 0x1001 and the last EMCY, for an operator."""
        parts = []
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

    @property
    def emergencies(self) -> tuple[Emergency, ...]:
        """EMCY objects received so far, oldest first."""
        return tuple(self.watch.emergencies)

    def position(self) -> int:
        """Actual position in counts, read now by SDO."""
        reference = self.profile.position
        return self.sdo.read(reference.index, reference.subindex, reference.type, "reading the position")

    def command_scale(self) -> float:
        """v per raw count of the current reference: scale and sign of the profile, times the rated value.

        Raises DriveError when the drive's rated value cannot be read or is zero.
        """
        reference = self.profile.current_reference
        factor = reference.sign * reference.scale
        rated = self.profile.rated
        if rated is not None:
            raw = self.sdo.read(rated.index, rated.subindex, rated.type, "reading the rated value")
            if not raw:
                raise DriveError(
                    self.node,
                    "reading the rated value that the current reference refers to",
                    index=rated.index,
                    subindex=rated.subindex,
                    expected="a value above zero",
                    received="0 came; enter the motor's rated value in the drive",
                )
            factor *= rated.sign * rated.scale * raw
        return factor

    # ---- network management ----

    def produce_heartbeat(self, period: float) -> None:
        """Let the drive send a heartbeat every `period` s (0 ends it)."""
        self.sdo.write_verified(
            _PRODUCER_HEARTBEAT, 0, "uint16", round(period * 1e3), "setting the heartbeat"
        )

    def watch_master(self, master: int, timeout: float) -> None:
        """Let the drive stop by itself when the heartbeat of node `master` fails for `timeout` s (0 ends
        it).
        """
        entry = (master & 0x7F) << 16 | round(timeout * 1e3) if timeout else 0
        self.sdo.write_verified(_CONSUMER_HEARTBEAT, 1, "uint32", entry, "setting the heartbeat consumer")

    def set_nmt_state(self, name: str) -> None:
        """OPERATIONAL, PRE-OPERATIONAL or STOPPED, confirmed by the drive's next heartbeat.

        Raises DriveError when no heartbeat shows that state in time.
        """
        command, wanted = _NMT_COMMANDS[name]
        # A heartbeat that was on its way before the command says nothing about it.
        self.watch.nmt_state = None
        self.network.send(0, bytes((command, self.node)))
        if not self.watch.wait_for(lambda: self.watch.nmt_state == wanted, self.timeouts.nmt):
            seen = self.watch.nmt_state
            raise DriveError(
                self.node,
                f"NMT command to {name}",
                expected=f"a heartbeat with {name} within {self.timeouts.nmt:g} s",
                received="none came" if seen is None else f"it says {nmt_state_in_words(seen)}",
            )

    def reset_node(self) -> None:
        """NMT reset, confirmed by the boot-up.

        Raises DriveError when no boot-up comes in time.
        """
        before = self.watch.boot_ups
        self.network.send(0, bytes((_NMT_RESET_NODE, self.node)))
        if not self.watch.wait_for(lambda: self.watch.boot_ups > before, self.timeouts.boot):
            raise DriveError(
                self.node,
                "NMT reset",
                expected=f"boot-up within {self.timeouts.boot:g} s",
                received="none came",
            )

    # ---- process data ----

    def map_stream(
        self, mode: Mode, *, temperature: bool = False, transmission_type: int = SYNCHRONOUS
    ) -> DriveStream:
        """Map position, current reference and statusword to synchronous TPDOs, controlword and target to
        RPDO 1.

        To be called in PRE-OPERATIONAL. All other PDOs are switched off. What is returned was read back.

        Raises DriveError when the drive refuses a mapping or says something else afterwards.
        """
        profile = self.profile
        wanted = [
            MappedEntry("position", profile.position.index, profile.position.subindex, profile.position.kind),
            MappedEntry(
                "command",
                profile.current_reference.index,
                profile.current_reference.subindex,
                profile.current_reference.kind,
            ),
            MappedEntry("statusword", cia402.STATUSWORD, 0, "<u2"),
        ]
        if temperature and profile.temperature is not None:
            reference = profile.temperature
            wanted.append(MappedEntry("temperature", reference.index, reference.subindex, reference.kind))
        groups = distribute(wanted)
        pdos = min(profile.transmit_pdos, len(_TPDO_BASE))
        if len(groups) > pdos:
            raise DriveError(
                self.node, "mapping TPDOs", expected=f"{len(groups)} TPDOs", received=f"it has {pdos}"
            )
        for number in range(1, pdos + 1):
            switch_off_pdo(self.sdo, "TPDO", number)
            switch_off_pdo(self.sdo, "RPDO", number)
        transmit = tuple(
            write_pdo(self.sdo, "TPDO", number, base + self.node, transmission_type, group)
            for number, (base, group) in enumerate(zip(_TPDO_BASE, groups, strict=False), 1)
        )
        index, subindex, kind = _TARGETS[mode]
        setpoint = [
            MappedEntry("controlword", cia402.CONTROLWORD, 0, "<u2"),
            MappedEntry("target", index, subindex, kind),
        ]
        receive = write_pdo(self.sdo, "RPDO", 1, _RPDO_BASE[0] + self.node, transmission_type, setpoint)
        return DriveStream(self.node, transmit, receive)

    def set_cycle(self, period: float) -> None:
        """Tell the drive the SYNC period (s): communication cycle 0x1006 and interpolation time 0x60C2.

        Raises DriveError when the drive takes neither, ValueError when 0x60C2 cannot express the period.
        """
        microseconds = round(period * 1e6)
        for exponent in (-3, -4, -5, -6):
            value = microseconds * 1e-6 / 10.0**exponent
            if abs(value - round(value)) < 1e-6 and 1 <= round(value) <= 255:
                break
        else:
            raise ValueError(
                f"a period of {period:g} s cannot be written as 1 to 255 units of a power of ten"
            )
        self.sdo.write_verified(0x60C2, 2, "int8", exponent, "setting the cycle")
        self.sdo.write_verified(0x60C2, 1, "uint8", round(value), "setting the cycle")
        try:
            self.sdo.write_verified(0x1006, 0, "uint32", microseconds, "setting the cycle")
        except DriveError as refusal:
            # Optional in CiA 301; drives that lack it run on 0x60C2 alone.
            if "does not exist" not in str(refusal):
                raise

    # ---- modes and states ----

    def set_mode(self, mode: Mode) -> None:
        """Switch the mode of operation and wait until 0x6061 shows it.

        Raises DriveError when the drive does not support the mode or does not show it in time.
        """
        supported = self._supported_modes()
        if supported is not None and not supported >> (mode - 1) & 1:
            raise DriveError(
                self.node,
                f"switching to {mode.words} (mode {int(mode)})",
                index=cia402.SUPPORTED_DRIVE_MODES,
                expected=f"bit {mode - 1}",
                received=f"0x{supported:08X} came: the drive does not support this mode",
            )
        self.sdo.write(cia402.MODE_OF_OPERATION, 0, "int8", int(mode), f"switching to {mode.words}")
        shown = self._wait(self.mode, lambda seen: seen == mode, self.timeouts.mode)
        if shown != mode:
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

    def home(self, method: int | None = None) -> None:
        """Run the drive's homing (mode 6) and wait until it is attained; the drive must be enabled.

        method : 0x6098; None leaves the drive's own

        Raises DriveError when the drive reports a homing error or does not finish in time.
        """
        if method is not None:
            self.sdo.write_verified(0x6098, 0, "int8", method, "setting the homing method")
        self.set_mode(Mode.HOMING)
        self.enable()
        enabled = Command.ENABLE_OPERATION.value
        self.sdo.write(cia402.CONTROLWORD, 0, "uint16", enabled, "homing")
        self.sdo.write(cia402.CONTROLWORD, 0, "uint16", enabled | cia402.START_HOMING, "homing")
        attained = cia402.HOMING_ATTAINED | cia402.TARGET_REACHED

        def finished(word: int) -> bool:
            at_end = word & attained == attained or word & cia402.HOMING_ERROR
            return bool(at_end) or cia402.state_of(word) is not State.OPERATION_ENABLED

        word = self._wait(self.statusword, finished, self.timeouts.homing)
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
