"""A CiA 402 drive on canopen: who it is, its network state, its process data; states and modes are inherited.

canopen's own CiA 402 node caches the statusword, returns silently from a failed mode switch and only logs
what fails in a callback. Here nothing is believed: a network state is taken from the next sign of life
(`network_management.py`), a PDO mapping is read back, and `state_machine.py` asks the drive for its state and mode each time.
"""

from dataclasses import dataclass

from drivers import cia402
from drivers.canopen_network import CanopenNetwork
from drivers.cia402 import Command, Mode
from drivers.emergency import Emergency
from drivers.errors import DriveError, DriverError
from drivers.network_management import ManagedNode
from drivers.object_dictionary import passed_over
from drivers.process_data import SYNCHRONOUS, DriveStream, is_missing, pdo_objects, was_refused
from drivers.profile import GENERIC, DriveProfile
from drivers.sdo import SdoAccess
from drivers.set_up_forecast import (
    StatedAccess,
    cycle_in_words,
    master_watch_in_words,
    objects_written,
    process_data_in_words,
)
from drivers.setpoint_timeout import SetpointWatch, end_watch, watch_setpoints
from drivers.standard_stream import TPDO_BASE, wanted_pdos
from drivers.state_machine import DEFAULT_TIMEOUTS, NO_MODE_DISPLAY, Timeouts
from drivers.stream_set_up import present_pdos, require_pdos, set_up_stream

_POSITION_POLARITY = 0x80
_OWN_TIMEOUT = "set its own time-out for missing setpoints or SYNC"


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


class Drive(ManagedNode):
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
        timeouts: Timeouts = DEFAULT_TIMEOUTS,
    ):
        if not 1 <= node <= 127:
            raise ValueError(f"a CANopen node id lies between 1 and 127, not {node}")
        remote = network.add_node(node)
        sdo = SdoAccess(node, remote, timeouts.sdo, timeouts.retries)
        super().__init__(network, node, sdo, timeouts)
        self.profile = profile
        self.passed_over = passed_over(profile.object_dictionary, node)
        """What of the drive's EDS could not be read, in words."""
        self._setpoint_watch: SetpointWatch | None = None

    # ---- who it is and how it is ----

    def identity(self) -> Identity:
        """Identity and device type, read now.

        Raises DriveError when the node does not answer, or is not of the profile's vendor.
        """
        read = self.sdo.read
        identity = Identity(
            self._optional(0x1018, 1)
            if self.profile.vendor_id is None
            else read(0x1018, 1, "uint32", "reading the vendor"),
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
        """An unsigned object; 0 where the drive does not have it. Raises DriveError when it does not answer."""
        try:
            return int.from_bytes(self.sdo.read_bytes(index, subindex)[:4], "little")
        except DriveError as refusal:
            if was_refused(refusal):
                return 0
            raise

    @property
    def emergencies(self) -> tuple[Emergency, ...]:
        """EMCY objects received so far, oldest first."""
        return tuple(self.watch.emergencies)

    def quick_stop_deceleration(self) -> int | None:
        """Quick stop deceleration, object 0x6085, in the drive's own unit: counts/s² with most; None where it is not told."""
        try:
            return self.sdo.read(0x6085, 0, "uint32", "reading the quick stop deceleration")
        except DriverError:
            return None

    def position(self) -> int:
        """Actual position in counts, read now by SDO."""
        reference = self.profile.position
        return self.sdo.read(reference.index, reference.subindex, reference.type, "reading the position")

    def rated_value(self) -> float | None:
        """What a current reference in fractions is a fraction of, in the profile's unit; None where the drive does not tell it.

        Raises DriveError when the drive does not answer, or says zero.
        """
        rated = self.profile.rated
        if rated is None:
            return None
        try:
            raw = self.sdo.read(rated.index, rated.subindex, rated.type, "reading the rated value")
        except DriveError as refusal:
            if is_missing(refusal):
                return None
            raise
        if not raw:
            raise DriveError(
                self.node,
                "reading the rated value that the current reference refers to",
                index=rated.index,
                subindex=rated.subindex,
                expected="a value above zero",
                received="0 came; enter the motor's rated value in the drive",
            )
        return abs(rated.scale * raw)

    # ---- what it lacks, and what is done at once ----

    def oddities(self) -> list[str]:
        """What the drive lacks of what we use, and what is done instead, in words; read now, nothing is written.

        Raises DriveError when the drive does not answer.
        """
        oddities: list[str] = []
        misses_us = self.misses_master_by
        if self.guarded:
            life = (
                "and notices by them when we are gone"
                if misses_us == "guarding"
                else "and notices by our heartbeat when we are gone"
                if misses_us
                else f"but does not notice when they end; {_OWN_TIMEOUT}"
            )
            oddities.append(
                f"has no heartbeat (0x1017): it is asked by remote frames (node guarding), {life}"
            )
        elif not misses_us:
            oddities.append(
                "has no heartbeat consumer (0x1016): we watch its heartbeat, but it does not notice when ours ends; "
                f"{_OWN_TIMEOUT}"
            )
        counts = {
            kind: sum(self._has(pdo_objects(kind, number)[0], 1) for number in range(1, len(TPDO_BASE) + 1))
            for kind in ("TPDO", "RPDO")
        }
        few = [f"{count} {kind}s" for kind, count in counts.items() if count < len(TPDO_BASE)]
        if few:
            oddities.append(f"has {' and '.join(few)}; the others are left alone")
        if not self._has(cia402.MODE_OF_OPERATION_DISPLAY):
            oddities.append(NO_MODE_DISPLAY)
        oddities += self._other_units()
        if not self._has(0x60C2, 1):
            oddities.append("has no interpolation time (0x60C2): it is given the cycle by 0x1006 alone")
        return oddities

    def set_up_in_advance(
        self, mode: Mode, cycle: float, *, temperature: bool = False, watches_us: bool = True
    ) -> list[str]:
        """What `map_stream`, `set_cycle` and `watch_master` will write, and what comes of it where the drive refuses, in words.

        Read now, nothing is written. By the access that the drive's own EDS states, where it has one.

        cycle      : s
        watches_us : whether it is to be told to notice when we are gone

        Raises DriveError when the drive lacks a PDO that is needed, or does not answer.
        """
        present = present_pdos(self.sdo, self.profile)
        wanted = wanted_pdos(self.node, self.profile, mode, temperature=temperature)
        require_pdos(self.node, wanted, present)
        stated = StatedAccess.of(self.profile, self.node, objects_written(wanted, present))
        communication = self._optional(0x1006, 0) if self._has(0x1006) else None
        held = self._interpolation_time()
        return [
            *process_data_in_words(present, wanted, stated),
            *cycle_in_words(held[0] * 10.0 ** held[1] if held else None, communication, cycle, stated),
            *(master_watch_in_words(self.misses_master_by, stated) if watches_us else ()),
        ]

    def _other_units(self) -> list[str]:
        """Where the drive's positions are not counts of its encoder, counted its way (CiA 402-2, factor group)."""
        units: list[str] = []
        if self._optional(0x607E, 0) & _POSITION_POLARITY:
            units.append(
                "counts the other way (polarity 0x607E, bit 7): the sign of gear_ratio must be that of the counts that it shows"
            )
        for index, name in ((0x6091, "gear ratio"), (0x6092, "feed constant"), (0x6093, "position factor")):
            numerator, divisor = self._optional(index, 1), self._optional(index, 2)
            if numerator and divisor and numerator != divisor:
                units.append(
                    f"has a {name} (0x{index:04X}) of {numerator}:{divisor}: encoder_counts must be what 0x6064 counts with it"
                )
        return units

    def disable_at_once(self) -> None:
        """Ask by SDO for no voltage, without waiting for an answer. Raises BusError when the bus refuses."""
        self._ask_at_once(Command.DISABLE_VOLTAGE)

    def quick_stop_at_once(self) -> None:
        """Ask by SDO for a quick stop, without waiting for an answer. Raises BusError when the bus refuses."""
        self._ask_at_once(Command.QUICK_STOP)

    def _ask_at_once(self, command: Command) -> None:
        index = cia402.CONTROLWORD
        request = bytes((0x2B, index & 0xFF, index >> 8, 0, command.value, 0, 0, 0))
        self._was_commanded = True
        self.network.send(0x600 + self.node, request)

    # ---- process data ----

    def map_stream(
        self,
        mode: Mode,
        *,
        temperature: bool = False,
        transmission_type: int = SYNCHRONOUS,
        torque: str | None = None,
    ) -> DriveStream:
        """Map position, current reference and statusword to synchronous TPDOs, controlword and target to
        RPDO 1.

        To be called in PRE-OPERATIONAL. All other PDOs are switched off, and only what differs is written. What is returned
        was read back. Where the drive refuses, its PDOs are used as they stand if they carry what is needed.

        torque : also map this entry to the RPDO, TORQUE_OFFSET (0x60B2) or TARGET_TORQUE (0x6071) of `process_data`; a drive
            that does not take it there is refused

        Raises DriveError when the drive refuses a mapping and has none that serves, or says something else afterwards.
        """
        wanted = wanted_pdos(
            self.node,
            self.profile,
            mode,
            temperature=temperature,
            transmission_type=transmission_type,
            torque=torque,
        )
        present = present_pdos(self.sdo, self.profile)
        self.as_found.keep(present)
        require_pdos(self.node, wanted, present)
        stream, remarks = set_up_stream(self.sdo, wanted, present, mode)
        self.set_up_remarks += remarks
        return stream

    def set_cycle(self, period: float) -> None:
        """Tell the drive the SYNC period (s): communication cycle 0x1006 and interpolation time 0x60C2.

        Raises DriveError when the drive takes neither, ValueError when 0x60C2 cannot express the period.
        """
        microseconds = round(period * 1e6)
        spellings = [
            (round(value), exponent)
            for exponent in (-3, -4, -5, -6)
            if abs((value := microseconds * 1e-6 / 10.0**exponent) - round(value)) < 1e-6
            and 1 <= round(value) <= 255
        ]
        if not spellings:
            raise ValueError(
                f"a period of {period:g} s cannot be written as 1 to 255 units of a power of ten"
            )
        interpolation = self._set_interpolation_time(spellings)
        communication = self._has(0x1006)
        if communication:
            try:
                self._hold(0x1006, 0, "uint32", microseconds, "setting the cycle")
            except DriveError as refusal:
                if not (interpolation and was_refused(refusal)):
                    raise
                self.set_up_remarks.append(
                    "keeps its communication cycle (0x1006), which can only be read; it has the cycle by 0x60C2"
                )
        if not interpolation and not communication:
            raise DriveError(
                self.node,
                "setting the cycle",
                index=0x60C2,
                expected="0x60C2 or 0x1006",
                received="the drive has neither, so that it cannot be given the time between two setpoints",
            )

    def _interpolation_time(self) -> tuple[int, int] | None:
        """Value and power of ten that 0x60C2 holds; None where the drive does not have it."""
        what = "reading the interpolation time"
        try:
            return self.sdo.read(0x60C2, 1, "uint8", what), self.sdo.read(0x60C2, 2, "int8", what)
        except DriveError as refusal:
            if is_missing(refusal):
                return None
            raise

    def clear_torque_offset(self) -> None:
        """Nought in 0x60B2, where the drive has it: a session that died may have left something.

        Raises DriveError when the drive refuses.
        """
        if self._has(cia402.TORQUE_OFFSET):
            self._hold(cia402.TORQUE_OFFSET, 0, "int16", 0, "clearing the torque offset")

    def leave_torque_mode(self, mode: Mode) -> None:
        """Without power: `mode` again, and nought as target torque (0x6071), where the drive is in cyclic torque mode.

        A session that was stopped leaves it there, with the last torque; whoever gave it power next would move the axis by it.
        Raises DriveError when the drive refuses.
        """
        if self.mode() == Mode.CYCLIC_SYNCHRONOUS_TORQUE:
            self._hold(cia402.TARGET_TORQUE, 0, "int16", 0, "clearing the target torque")
            self.set_mode(mode)

    def watch_setpoints(self, stream: DriveStream, timeout: float) -> str:
        """Let the drive stop by itself when no setpoint comes for `timeout` (s); in words what it does then.

        Raises DriveError when it cannot be told to (`setpoint_timeout`).
        """
        self._setpoint_watch = watch_setpoints(self.sdo, stream.receive, timeout)
        return self._setpoint_watch.words

    def end_setpoint_watch(self) -> None:
        """Give the drive the watch over its setpoints back that it had before `watch_setpoints`, where that was called.

        Raises DriveError when the drive does not answer, or keeps what it holds.
        """
        watch, self._setpoint_watch = self._setpoint_watch, None
        if watch is not None:
            end_watch(self.sdo, watch)

    def _set_interpolation_time(self, spellings: list[tuple[int, int]]) -> bool:
        """Whether 0x60C2 now holds a period; False where the drive has no such object.

        spellings : (value, exponent) of value · 10^exponent s, all of them the same period. The drive's own exponent is kept
            where it can be: some drives let it be read only.
        """
        what = "setting the cycle"
        held = self._interpolation_time()
        if held is None:
            return False
        value, exponent = next((each for each in spellings if each[1] == held[1]), spellings[0])
        wanted, present = value * 10.0**exponent, held[0] * 10.0 ** held[1]
        if abs(present / wanted - 1) < 1e-9:
            return True
        try:
            self._hold(0x60C2, 2, "int8", exponent, what)
            self._hold(0x60C2, 1, "uint8", value, what)
        except DriveError as refusal:
            refused = f"{refusal.received}; it is set to {present:g} s: give the rig that cycle"
            raise DriveError(
                self.node, what, index=0x60C2, subindex=1, expected=f"{wanted:g} s", received=refused
            ) from refusal
        return True
