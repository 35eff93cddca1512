"""The rig's drives over canopen: checked, configured, watched. Nothing here moves anything.

Process data go another way (`daq/sampling_loop.py`); canopen never sees a TPDO.
"""

import contextlib
import time
from collections import deque
from dataclasses import asdict, dataclass
from pathlib import Path

import numpy as np

from daq.rig import Axis, Rig
from daq.safety import StopCause, StopReason
from drivers.canopen_network import CanopenNetwork
from drivers.cia402 import HOMING_ATTAINED, HOMING_ERROR, Mode, State
from drivers.drive import Drive
from drivers.emergency import Emergency, code_in_words
from drivers.errors import DriverError
from drivers.process_data import DriveStream
from drivers.profile import DriveProfile

MASTER_NODE = 127
"""Our own node id: the heartbeat under it is what the drives watch."""

MODES = {
    "cyclic-synchronous-position": Mode.CYCLIC_SYNCHRONOUS_POSITION,
    "interpolated-position": Mode.INTERPOLATED_POSITION,
}
_EMERGENCY_POLL = 0.01
"""s"""
_RATED_TOLERANCE = 0.01
"""relative; the drive holds its rated value as a whole number of mN m or mA"""


@dataclass(frozen=True)
class CheckItem:
    """One thing that was looked at before a session."""

    what: str
    ok: bool
    words: str


@dataclass(frozen=True)
class RigCheck:
    """Everything that was looked at before a session."""

    items: tuple[CheckItem, ...]

    @property
    def ok(self) -> bool:
        """Whether the session may go on."""
        return all(item.ok for item in self.items)

    @property
    def problems(self) -> str:
        """What is wrong, in one line."""
        return "; ".join(f"{item.what}: {item.words}" for item in self.items if not item.ok)

    def to_json(self) -> dict[str, object]:
        """Plain values."""
        return {"ok": self.ok, "items": [asdict(item) for item in self.items]}


class RigDrives:
    """All drives of a rig on their network.

    Raises BusError when the bus cannot be opened.
    """

    def __init__(self, rig: Rig) -> None:
        self.rig = rig
        self.network = CanopenNetwork(rig.bus)
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

    def check(self) -> RigCheck:
        """Look at every drive: is it there, is it what the rig file says, is it without fault, is it homed?"""
        items: list[CheckItem] = []
        for axis, drive, profile in zip(self.rig.axes, self.drives, self.rig.profiles, strict=True):
            what = f"joint {axis.joint} (node {axis.node})"
            if drive.passed_over:
                named = Path(profile.object_dictionary).name
                items.append(CheckItem(what, True, f"{named}: passed over {'; '.join(drive.passed_over)}"))
            try:
                items += [CheckItem(what, ok, words) for ok, words in self._look(axis, drive, profile)]
            except DriverError as error:
                items.append(CheckItem(what, False, str(error)))
        if all(item.ok for item in items):
            items += self._within_limits()
        return RigCheck(tuple(items))

    def _look(self, axis: Axis, drive: Drive, profile: DriveProfile) -> list[tuple[bool, str]]:
        # A drive that an earlier session left streaming must not answer SDOs between its PDOs.
        drive.produce_heartbeat(self.rig.supervision.heartbeat_period)
        drive.set_nmt_state("PRE-OPERATIONAL")
        identity = drive.identity()
        found = [
            (
                identity.profile == 402,
                f"vendor 0x{identity.vendor:X}, product 0x{identity.product:X}, "
                f"device profile {identity.profile}{'' if identity.profile == 402 else ', not a drive (402)'}",
            )
        ]
        state = drive.state()
        if state is State.FAULT:
            return [*found, (False, f"in FAULT: {drive.error_in_words()}; reset it when the cause is gone")]
        if state is State.OPERATION_ENABLED:
            return [*found, (False, "is enabled already: somebody else commands it")]
        found.append((True, f"state {state.words}"))
        if profile.rated is not None:
            scale = drive.command_scale()
            believed = axis.rated_torque if profile.rated.unit == "N m" else axis.rated_current
            assert believed is not None
            rated = abs(scale / profile.current_reference.scale)
            ok = abs(rated / believed - 1) <= _RATED_TOLERANCE
            found.append(
                (
                    ok,
                    f"rated {rated:g} {profile.rated.unit}"
                    + ("" if ok else f"; the rig file says {believed:g}: one of them is wrong"),
                )
            )
        if axis.homing == "drive":
            found.append(self._homed(drive))
        return found

    def _homed(self, drive: Drive) -> tuple[bool, str]:
        bit = drive.profile.homed_bit
        if bit is not None:
            homed = bool(drive.statusword() >> bit & 1)
        else:
            drive.set_mode(Mode.HOMING)
            word = drive.statusword()
            homed = bool(word & HOMING_ATTAINED) and not word & HOMING_ERROR
        return homed, "homed" if homed else f"is not homed; `coulomb home {self.rig.name}` homes it"

    def _within_limits(self) -> list[CheckItem]:
        try:
            position = self.positions()
        except DriverError as error:
            return [CheckItem("positions", False, str(error))]
        items: list[CheckItem] = []
        for axis, value in zip(self.rig.axes, position, strict=True):
            lowest, highest = axis.limits.position
            slack = axis.limits.following_error
            ok = bool(lowest - slack <= value <= highest + slack)
            words = f"stands at {value:.4g}" + (
                "" if ok else f", outside its limits {lowest:g} to {highest:g}"
            )
            items.append(CheckItem(f"joint {axis.joint}", ok, words))
        return items

    def positions(self) -> np.ndarray:
        """(n,) joint positions, rad or m, read now by SDO."""
        counts = np.array([drive.position() for drive in self.drives])
        return self.rig.position_matrix @ counts + self.rig.position_offset

    def configure(self) -> list[DriveStream]:
        """Mapping, mode, cycle, heartbeats; every drive stays without power. What each will send and take.

        Raises DriveError when a drive refuses.
        """
        streams: list[DriveStream] = []
        for axis, drive in zip(self.rig.axes, self.drives, strict=True):
            drive.disable()
            streams.append(drive.map_stream(MODES[axis.mode], temperature=self.rig.record_temperature))
            drive.set_mode(MODES[axis.mode])
            drive.set_cycle(self.rig.cycle)
            if self.rig.bus.interface != "virtual":
                # Our death must be noticed by the drives themselves: a killed process cannot stop anything.
                drive.watch_master(MASTER_NODE, self._silence)
        return streams

    def stream(self) -> None:
        """Let the drives exchange process data (NMT OPERATIONAL). Raises DriveError when one does not."""
        for drive in self.drives:
            drive.set_nmt_state("OPERATIONAL")

    def heartbeat(self) -> None:
        """Send our own heartbeat once; BusError when the bus refuses."""
        self.network.send(0x700 + MASTER_NODE, b"\x05")

    def emergency(self, timeout: float = 0.0) -> StopReason | None:
        """The oldest EMCY not told yet, waited for up to `timeout` (s); None where there is none."""
        deadline = time.monotonic() + timeout
        while True:
            while self._emergencies:
                emergency = self._emergencies.popleft()
                if not emergency.is_reset:
                    words = f"{self._joint(emergency.node)}: EMCY {code_in_words(emergency.code)}"
                    return StopReason(StopCause.EMERGENCY, words)
            if time.monotonic() >= deadline:
                return None
            time.sleep(_EMERGENCY_POLL)

    def trouble(self) -> StopReason | None:
        """What the drives complain of: an EMCY, or a heartbeat that has stopped."""
        emergency = self.emergency()
        if emergency is not None:
            return emergency
        for drive in self.drives:
            silence = drive.watch.silence
            if silence is not None and silence > self._silence:
                words = f"{self._joint(drive.node)}: no heartbeat for {silence:.2g} s"
                return StopReason(StopCause.LOST_HEARTBEAT, words)
        return None

    def _joint(self, node: int) -> str:
        joint = next(axis.joint for axis in self.rig.axes if axis.node == node)
        return f"joint {joint} (node {node})"

    def close(self) -> None:
        """Leave the drives without power and silent, as far as they answer, and leave the bus."""
        for drive in self.drives:
            with contextlib.suppress(DriverError):
                if self.rig.bus.interface != "virtual":
                    drive.watch_master(MASTER_NODE, 0)
                drive.disable()
                drive.set_nmt_state("PRE-OPERATIONAL")
                drive.produce_heartbeat(0)
        self.network.close()
