"""After a fault the way out is a reset, which leaves the zero alone; a drive in another's hands is not touched."""

import pytest

from daq.drive_reset import reset_drives
from daq.homing import joints_to_home
from daq.rig_check import check_rig
from daq.rig_drives import RigDrives
from drivers.cia402 import Command, State
from drivers.simulated import process_image as slot
from identify.recording import InputError


def problems(rig) -> str:
    drives = RigDrives(rig)
    try:
        return check_rig(drives).problems
    finally:
        drives.close()


def test_a_fault_names_its_way_out_which_changes_no_zero(still_rig, powered):
    drive = powered.nodes[0].drive
    drive.image[slot.POSITION] = 12345
    zero = drive.position_offset
    drive.fail(0x4310)
    said = problems(still_rig)
    assert "in FAULT: 0x4310 motor or transmission too hot" in said
    assert f"`coulomb reset {still_rig.name}` resets it" in said
    (joint,) = reset_drives(still_rig)
    assert joint.ok
    assert "fault reset; it was 0x4310" in joint.words
    assert drive.machine.state is State.SWITCH_ON_DISABLED
    assert drive.position_offset == zero
    assert problems(still_rig) == ""


def test_nothing_is_written_to_a_drive_that_has_power(still_rig, powered):
    node = powered.nodes[0]
    for command in (Command.SHUTDOWN, Command.SWITCH_ON, Command.ENABLE_OPERATION):
        node.drive.image[slot.CONTROLWORD] = command.value
        node.drive.take_controlword()
    node.take_nmt(1, node.node)
    written = []
    set_data = node.set_data
    node.set_data = lambda *data, **more: (written.append(data), set_data(*data, **more))[1]
    drives = RigDrives(still_rig)
    said = check_rig(drives).problems
    assert "has power (it is in OPERATION ENABLED)" in said
    assert "nothing was written to it" in said
    assert written == []
    assert node.nmt_state == 5
    assert node.drive.machine.state is State.OPERATION_ENABLED
    drives.close()
    assert written == []
    assert (node.nmt_state, node.drive.machine.state) == (5, State.OPERATION_ENABLED), "it may be another's"
    (joint,) = reset_drives(still_rig)
    assert joint.ok
    assert "had power (OPERATION ENABLED), which was taken" in joint.words
    assert node.drive.machine.state is State.SWITCH_ON_DISABLED


def test_a_drive_without_a_fault_is_left_as_it_is(still_rig, powered):
    (joint,) = reset_drives(still_rig)
    assert (joint.ok, joint.words) == (True, "nothing to reset: in SWITCH ON DISABLED")


def test_an_absolute_encoder_is_never_homed(still_rig):
    with pytest.raises(
        InputError, match=r"joint j3: has an absolute encoder .* `coulomb reset rx130l-joint3"
    ):
        joints_to_home(still_rig, ("j3",))
