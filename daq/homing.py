"""Homing: a drive that has lost its reference finds it again (mode 6), one joint after the other.

The drive itself moves the axis, as its own homing method and speeds say; no plan and no limit of the rig file watches it,
for before homing a position means nothing. What watches: the operator, the drive's own faults, and our heartbeat, without
which the drive stops by itself.
"""

import contextlib
import threading
from collections.abc import Generator
from dataclasses import dataclass

from daq.rig import Rig
from daq.rig_drives import MASTER_NODE, POWERED, RigDrives
from drivers.cia402 import State
from drivers.errors import DriveError, DriverError
from identify.recording.errors import InputError


@dataclass(frozen=True)
class HomedJoint:
    """A joint after its homing.

    position : rad or m, where it stands now by the rig file's `home`
    words : for the operator
    """

    joint: str
    position: float
    within_limits: bool
    words: str


def joints_to_home(rig: Rig, named: tuple[str, ...] = ()) -> list[int]:
    """Axes to be homed: those named, in that order, or all that the rig file says are homed by their drive.

    Raises InputError where a name is no joint's, or no joint needs homing.
    """
    joints = [axis.joint for axis in rig.axes]
    for name in named:
        if name not in joints:
            raise InputError(f"joint {name}: rig {rig.name} has {', '.join(joints)}")
        axis = rig.axes[joints.index(name)]
        if axis.homing != "drive":
            raise InputError(
                f"joint {name}: has an absolute encoder (`homing: absolute-encoder` in rig {rig.name}), whose zero homing would "
                f"falsify. To reset a fault: `coulomb reset {rig.name}`. If it is to be homed all the same, the rig file "
                "must say `homing: drive`"
            )
    if named:
        return [joints.index(name) for name in named]
    by_drive = [index for index, axis in enumerate(rig.axes) if axis.homing == "drive"]
    if not by_drive:
        raise InputError(
            f"rig {rig.name}: no axis has `homing: drive`, all have absolute encoders, which need no homing; to reset a fault: "
            f"`coulomb reset {rig.name}`"
        )
    return by_drive


def require_lasting_drives(rig: Rig) -> None:
    """Raises InputError for a rig whose simulated drives live only as long as a session."""
    if rig.bus.interface == "virtual":
        raise InputError(
            f"rig {rig.name}: its simulated drives live only as long as a session; put them on a real bus with "
            "`coulomb fake-drive` to home them, reset them or write to them"
        )


class Homing:
    """The rig's drives, ready to be homed; a context manager.

    stop : set from any thread, it brings the axis that is being homed to rest; no axis is homed afterwards

    Raises BusError when the bus cannot be opened.
    """

    def __init__(self, rig: Rig, stop: threading.Event | None = None) -> None:
        self.rig = rig
        self._stopped = stop or threading.Event()
        self._drives = RigDrives(rig, "homing")

    def __enter__(self) -> "Homing":
        return self

    def __exit__(self, *exception: object) -> None:
        self._drives.close()

    def reset_faults(self) -> list[str]:
        """Reset every drive that is in FAULT; what was done, in words.

        Raises DriveError, with the drive's reason, when a fault stays.
        """
        done: list[str] = []
        for axis, drive in zip(self.rig.axes, self._drives.drives, strict=True):
            if drive.state() is State.FAULT:
                reason = drive.error_in_words()
                drive.reset_fault()
                done.append(f"joint {axis.joint} (node {axis.node}): fault reset; it was {reason}")
        return done

    def home(self, index: int, method: int | None = None) -> HomedJoint:
        """Home one axis and leave it without power, held by its brake.

        method : of 0x6098; None leaves the drive's own

        Raises DriveError when the drive reports an error, does not finish in time or was stopped. Whatever is raised, an
        interruption by the operator too, the axis is stopped first.
        """
        axis, drive = self.rig.axes[index], self._drives.drives[index]
        if self._drives.state_before_writing(drive) in POWERED:
            raise DriveError(
                drive.node,
                "homing",
                received=f"it has power already; nothing was written to it. `coulomb reset {self.rig.name}` takes its power, if "
                "nobody else commands it",
            )
        drive.produce_heartbeat(self.rig.supervision.heartbeat_period)
        with self._heartbeats(index):
            drive.set_nmt_state("OPERATIONAL")
            try:
                drive.home(method, self._stopped.is_set)
            except BaseException:
                with contextlib.suppress(DriverError):
                    drive.quick_stop()
                raise
            finally:
                with contextlib.suppress(DriverError):
                    drive.disable()
            drive.set_nmt_state("PRE-OPERATIONAL")
        position = float(self._drives.positions()[index])
        lowest, highest = axis.limits.position
        within = lowest <= position <= highest
        unit = "m" if self.rig.robot.joints[index].type == "prismatic" else "rad"
        outcome = f"homed; is at {position:.4g} {unit}"
        if not within:
            outcome += f", outside its limits {lowest:g} to {highest:g} {unit}: move it there by hand, or correct `home`"
        return HomedJoint(axis.joint, position, within, outcome)

    @contextlib.contextmanager
    def _heartbeats(self, index: int) -> Generator[None]:
        """Our sign of life, without which the drive stops by itself."""
        drive, supervision = self._drives.drives[index], self.rig.supervision
        self._drives.heartbeat()
        drive.watch_master(MASTER_NODE, supervision.heartbeat_timeout)
        ended = threading.Event()

        def beat() -> None:
            while not ended.wait(0.5 * supervision.heartbeat_period):
                # A bus that is gone is found by the next SDO; the drive, which hears nothing either, stops.
                with contextlib.suppress(DriverError):
                    self._drives.heartbeat()

        thread = threading.Thread(target=beat, name="homing-heartbeat", daemon=True)
        thread.start()
        try:
            yield
        finally:
            with contextlib.suppress(DriverError):
                drive.end_master_watch()
            ended.set()
            thread.join()
