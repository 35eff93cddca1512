"""The rig's drives over canopen: configured, watched, left without power. Nothing here moves anything.

Process data go another way (`daq/sampling_loop.py`); canopen never sees a TPDO.
"""

import contextlib
import time
from collections import deque
from collections.abc import Callable, Mapping
from types import MappingProxyType

import numpy as np

from daq.power_off import AxisPower, PowerCut, PowerReport, read_power
from daq.rig import Axis, Rig
from daq.safety import StopCause, StopReason
from drivers.as_found import HeldSettings
from drivers.bus_claim import BusClaim
from drivers.canopen_network import CanopenNetwork
from drivers.cia402 import Mode, State
from drivers.drive import Drive
from drivers.emergency import Emergency, code_in_words
from drivers.errors import DriveError, DriverError
from drivers.process_data import TARGET_TORQUE, TORQUE_OFFSET, DriveStream, was_refused
from drivers.safety_output import SafetyOutput

RESTARTED = (
    "it restarted (its boot-up was heard): look at its supply, its earth and its watchdog, then start again; or a second node "
    "with its id was switched on, which `coulomb scan` shows"
)
MASTER_NODE = 127
"""Our own node id: the heartbeat under it is what the drives watch."""
OUR_HEARTBEAT = 0x700 + MASTER_NODE

MODES = {
    "cyclic-synchronous-position": Mode.CYCLIC_SYNCHRONOUS_POSITION,
    "interpolated-position": Mode.INTERPOLATED_POSITION,
}
_EMERGENCY_POLL = 0.01
"""s"""
_LOOK_TWICE = 0.02
"""s between two positions that tell whether an axis moves"""
_QUICK_STOP = 0.6
"""s in which drives are to rest by their quick stop, before power is cut"""
_MODE_ANSWER = 0.05
"""s for a drive's answers while its mode is changed: the axes have power and are watched again only then"""
_CLOSING_ANSWER = 0.1
"""s for a drive's answers while the bus is left"""
_ENTER_PRE_OPERATIONAL = 128
"""NMT command"""
_SIGNS_MISSED = 2.5
"""signs of life that a drive may miss whose heartbeat time is its own"""
POWERED = frozenset({State.OPERATION_ENABLED, State.QUICK_STOP_ACTIVE, State.FAULT_REACTION_ACTIVE})
"""states in which a drive's power stage gives torque"""


class RigDrives:
    """All drives of a rig on their network, which nobody else may use meanwhile.

    purpose : what for, in words for whoever wants the bus too

    Raises BusInUse while somebody else has the bus, BusError when it cannot be opened.
    """

    def __init__(self, rig: Rig, purpose: str = "a session") -> None:
        self.rig = rig
        self._claim = BusClaim(rig.bus, f"{purpose} of rig {rig.name}")
        self.output: SafetyOutput | None = None
        try:
            self.network = CanopenNetwork(rig.bus)
            try:
                if rig.safety_output is not None:
                    self.output = SafetyOutput(rig.safety_output, self.network.send)
            except BaseException:
                self.network.close()
                raise
        except BaseException:
            self._claim.close()
            raise
        self.drives = [
            Drive(self.network, axis.node, profile)
            for axis, profile in zip(rig.axes, rig.profiles, strict=True)
        ]
        self._emergencies: deque[Emergency] = deque()
        for drive in self.drives:
            drive.watch.on_emergency = self._emergencies.append
        # In simulated time the drives' heartbeats still go by the wall clock, beside a process that is busy.
        patience = 1.0 if rig.pacing == "real-time" else 10.0
        self._silence = rig.supervision.heartbeat_timeout * patience

    def state_before_writing(self, drive: Drive) -> State:
        """What the drive says of itself. Only one in NMT STOPPED, where it cannot answer, is made able to first."""
        try:
            return drive.state()
        except DriverError:
            self.network.send(0, bytes((_ENTER_PRE_OPERATIONAL, drive.node)))
            return drive.state()

    def positions(self) -> np.ndarray:
        """(n,) joint positions, rad or m, read now by SDO."""
        counts = np.array([drive.position() for drive in self.drives])
        return self.rig.position_matrix @ counts + self.rig.position_offset

    def configure(self, torque: str | None = None) -> list[DriveStream]:
        """Mapping, mode, cycle, heartbeats; every drive stays without power. What each will send and take.

        torque : the torque that the drives are to take beside their target position: TORQUE_OFFSET (0x60B2), or TARGET_TORQUE
            (0x6071) for cyclic torque mode, where they must stop by themselves when it stays away

        Raises DriveError when a drive refuses.
        """
        streams: list[DriveStream] = []
        for axis, drive in zip(self.rig.axes, self.drives, strict=True):
            drive.expect_no_restart()
            try:
                streams.append(self._configured(axis, drive, torque))
            except DriveError as error:
                if drive.restarted:
                    raise error.with_cause(RESTARTED) from error
                raise
        if self.rig.bus.interface != "virtual":
            # Our death must be noticed by the drives themselves: a killed process cannot stop anything. Last, for from now on
            # they wait for our signs of life.
            for drive in self.drives:
                drive.watch_master(MASTER_NODE, self._silence)
            self.heartbeat()
        return streams

    def _configured(self, axis: Axis, drive: Drive, torque: str | None) -> DriveStream:
        drive.disable()
        drive.clear_torque_offset()
        if torque == TORQUE_OFFSET:
            _require_no_table(drive)
        stream = drive.map_stream(MODES[axis.mode], temperature=self.rig.record_temperature, torque=torque)
        drive.set_mode(MODES[axis.mode])
        drive.set_cycle(self.rig.cycle)
        if torque == TARGET_TORQUE:
            drive.set_up_remarks.append(drive.watch_setpoints(stream, self.rig.supervision.torque_timeout))
        return stream

    def set_mode(self, mode: Mode | None) -> None:
        """Switch all drives, at rest, to a mode, or back to each axis's own; 0x6061 confirms it.

        Raises DriveError when a drive refuses, does not show it, or has no mode display.
        """
        for axis, drive in zip(self.rig.axes, self.drives, strict=True):
            wanted = mode or MODES[axis.mode]
            with drive.sdo.hurried(_MODE_ANSWER, 1):
                drive.set_mode(wanted)
                shown = drive.mode()
            if shown != wanted:
                raise DriveError(
                    drive.node,
                    f"switching to {wanted.words} (mode {int(wanted)})",
                    index=0x6061,
                    expected=str(int(wanted)),
                    received="the drive has no mode display" if shown is None else f"{shown} came",
                )

    def end_setpoint_watch(self) -> None:
        """Give the drives the watch over their setpoints back that they had before torque mode. Raises DriveError."""
        for drive in self.drives:
            with drive.sdo.hurried(_MODE_ANSWER, 1):
                drive.end_setpoint_watch()

    def stream(self) -> None:
        """Let the drives exchange process data (NMT OPERATIONAL). Raises DriveError when one does not."""
        for drive in self.drives:
            drive.set_nmt_state("OPERATIONAL")

    def heartbeat(self) -> None:
        """Send our own sign of life once, and ask the drives that have none of their own; BusError when the bus refuses."""
        self.network.send(0x700 + MASTER_NODE, b"\x05")
        for drive in self.drives:
            drive.ask_if_alive()

    def emergency(self, timeout: float = 0.0) -> StopReason | None:
        """The oldest EMCY not told yet, waited for up to `timeout` (s); None where there is none."""
        deadline = time.monotonic() + timeout
        while True:
            while self._emergencies:
                emergency = self._emergencies.popleft()
                if not emergency.is_reset:
                    sentence = f"{self.joint(emergency.node)}: EMCY {code_in_words(emergency.code)}"
                    return StopReason(StopCause.EMERGENCY, sentence)
            if time.monotonic() >= deadline:
                return None
            time.sleep(_EMERGENCY_POLL)

    def trouble(self) -> StopReason | None:
        """What the drives complain of: an EMCY, or a heartbeat that has stopped."""
        emergency = self.emergency()
        if emergency is not None:
            return emergency
        restart = self.restart()
        if restart is not None:
            return restart
        for drive in self.drives:
            silence = drive.watch.silence
            if silence is not None and silence > max(
                self._silence, _SIGNS_MISSED * drive.sign_of_life_period
            ):
                sign = "answer to node guarding" if drive.guarded else "heartbeat"
                sentence = f"{self.joint(drive.node)}: no {sign} for {silence:.2g} s"
                return StopReason(StopCause.LOST_HEARTBEAT, sentence)
        return None

    def restart(self) -> StopReason | None:
        """A drive that has booted since it was set up, without having been told to; each once."""
        for drive in self.drives:
            if drive.restarted:
                drive.expect_no_restart()
                return StopReason(StopCause.RESTARTED, f"{self.joint(drive.node)}: {RESTARTED}")
        return None

    def joint(self, node: int) -> str:
        """The joint of a node, in words for the operator."""
        joint = next(axis.joint for axis in self.rig.axes if axis.node == node)
        return f"joint {joint} (node {node})"

    def power(self) -> PowerReport:
        """Whether each drive has no power and stands still, read now."""
        return read_power(self.rig, self.drives)

    def cut(self, by_rpdo: Callable[[], None], tell: Callable[[str], None]) -> PowerCut:
        """Everything that takes the power of all axes, ready to be started."""
        return PowerCut(self.rig, self.drives, self.output, by_rpdo, tell)

    def held_before(self) -> dict[int, HeldSettings]:
        """By node what the drives held before they were set up, for a process that has to put it back."""
        return {drive.node: drive.as_found.held for drive in self.drives}

    def close(self) -> list[str]:
        """Leave the drives without power, in PRE-OPERATIONAL, their settings as they were found, as far as they answer; and leave
        the bus. What could not be put back, in words.

        A drive that is not read back without power goes on watching our heartbeat, which ends now: so it stops by itself.
        One that was only looked at is left as it was found: somebody else may be moving its axis.
        """
        left: list[str] = []
        try:
            for axis, drive in zip(self.rig.axes, self.drives, strict=True):
                if drive.is_as_found:
                    continue
                try:
                    with drive.sdo.hurried(_CLOSING_ANSWER, 1):
                        drive.disable()
                        drive.leave_torque_mode(MODES[axis.mode])
                        # First: from now on it misses our setpoints and our sign of life.
                        drive.end_setpoint_watch()
                        drive.end_master_watch()
                        drive.set_nmt_state("PRE-OPERATIONAL")
                        refused = drive.as_found.put_back()
                except DriverError as silent:
                    left.append(f"{self.joint(drive.node)}: {silent}")
                else:
                    left += [f"{self.joint(drive.node)}: it keeps {each}" for each in refused]
            return left
        finally:
            self.network.close()
            if self.output is not None:
                self.output.close()
            self._claim.close()


def _require_no_table(drive: Drive) -> None:
    """Raises DriveError where the drive adds friction by a table of its own, which would act twice."""
    held = friction_table(drive)
    if held is not None:
        raise DriveError(
            drive.node,
            "sending feedforward torque",
            index=held[0],
            subindex=held[1],
            expected="0, for friction that is in the feedforward torque too would act twice",
            received="the drive has a friction table of its own; set its currents to 0 first",
        )


def friction_table(drive: Drive) -> tuple[int, int] | None:
    """Index and subindex of a current that the drive adds by a friction table of its own; None where it adds none.

    Raises DriveError where the drive does not answer.
    """
    compensation = drive.profile.compensation
    if compensation is None or compensation.friction is None:
        return None
    for row in (compensation.friction.forward, compensation.friction.backward):
        if row is None:
            continue
        for subindex in range(row.subindex, row.subindex + row.points):
            try:
                if drive.sdo.read(row.index, subindex, row.type, "looking for a friction table"):
                    return row.index, subindex
            except DriveError as error:
                if was_refused(error):  # of a firmware that has no such table
                    return None
                raise
    return None


def take_power(rig: Rig, held_before: Mapping[int, HeldSettings] = MappingProxyType({})) -> PowerReport:
    """The process that moved the rig is gone: stop its drives from here, take their power, and say what they said.

    held_before : by node what they held before that process set them up, as far as it could tell; it is put back

    Drives that watch our heartbeat stop by themselves meanwhile. Nothing is raised: what failed is in the report.
    """
    try:
        drives = RigDrives(rig, "taking the power")
    except DriverError as error:
        return PowerReport(
            tuple(AxisPower(axis.joint, axis.node, False, None, str(error)) for axis in rig.axes)
        )
    try:
        for drive in drives.drives:
            if drive.node in held_before:
                drive.as_found.held = held_before[drive.node]
            with contextlib.suppress(DriverError):
                drive.quick_stop_at_once()
        latest = time.monotonic() + _QUICK_STOP
        while (report := drives.power()).alarm and time.monotonic() < latest:
            time.sleep(_LOOK_TWICE)
        if report.alarm:
            cut = drives.cut(_no_rpdo, _nobody)
            cut.start()
            cut.wait()
            report = drives.power()
        return report
    finally:
        drives.close()


def _no_rpdo() -> None:
    """Without a stream there is none."""


def _nobody(alarm: str) -> None:
    """The report says it all."""
