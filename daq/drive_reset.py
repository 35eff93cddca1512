"""After a fault: every drive of a rig is brought to rest without power and without fault; its zero is left alone.

Homing is another matter. A rig with absolute encoders needs none after a fault, and would lose its zero by it.
"""

from dataclasses import dataclass

from daq.power_off import OFF
from daq.rig import Rig
from daq.rig_drives import POWERED, RigDrives
from drivers.cia402 import State
from drivers.errors import DriverError


@dataclass(frozen=True)
class ResetJoint:
    """A drive after the reset.

    ok : it has no power and no fault
    words : what was found, what was done, what is left
    """

    joint: str
    node: int
    ok: bool
    words: str


def reset_drives(rig: Rig) -> list[ResetJoint]:
    """Take the power of every drive that has some, reset every fault. No axis is moved, no zero is changed.

    An axis without a brake sinks when its power goes: stand by it.

    Raises BusInUse while a session, a homing or a scan has the bus, BusError when it cannot be opened.
    """
    drives = RigDrives(rig, "a reset of the drives")
    try:
        return [_reset(drives, index) for index in range(len(rig.axes))]
    finally:
        drives.close()


def _reset(drives: RigDrives, index: int) -> ResetJoint:
    axis, drive = drives.rig.axes[index], drives.drives[index]
    events: list[str] = []
    try:
        state = drives.state_before_writing(drive)
        if state in POWERED:
            drive.quick_stop()
            drive.disable()
            events.append(f"had power ({state.words}), which was taken")
        if drive.state() is State.FAULT:
            reason = drive.error_in_words()
            drive.reset_fault()
            events.append(f"fault reset; it was {reason}")
        state = drive.state()
    except DriverError as error:
        return ResetJoint(axis.joint, axis.node, False, "; ".join([*events, str(error)]))
    ok = state in OFF and state is not State.FAULT
    events.append(f"now in {state.words}" if events else f"nothing to reset: in {state.words}")
    return ResetJoint(axis.joint, axis.node, ok, "; ".join(events))
