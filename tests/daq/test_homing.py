"""Homing from the rig file, on the simulated drive."""

import threading

import pytest

from daq.homing import Homing, joints_to_home
from daq.rig_check import check_rig
from daq.rig_drives import RigDrives
from daq.simulated_rig import simulated_rig
from drivers.bus import BusSettings
from drivers.cia402 import State
from drivers.errors import DriveError
from drivers.profile import load_profile
from drivers.simulated import process_image as slot
from identify.recording import InputError


@pytest.fixture
def homed_by_drive(rig):
    """The rig with a drive that must be homed, on a bus of its own."""
    axis = rig.axes[0].model_copy(update={"homing": "drive"})
    bus = BusSettings(interface="virtual", channel="homing")
    return rig.model_copy(update={"axes": (axis,), "bus": bus})


@pytest.fixture
def powered(homed_by_drive):
    """The simulated drives of that rig, as long as the test lasts; without SYNC they act within a twentieth of a second."""
    simulated = {**homed_by_drive.simulated, "sync_timeout": 0.05}
    with simulated_rig(
        homed_by_drive.model_copy(update={"simulated": simulated}), homed_by_drive.payload("none")
    ) as on:
        yield on


def checked(rig) -> str:
    drives = RigDrives(rig)
    try:
        return check_rig(drives).problems
    finally:
        drives.close()


@pytest.mark.parametrize("method", [34, 37])
def test_a_joint_that_was_not_homed_is_refused_until_it_has_been(homed_by_drive, powered, method):
    assert "is not homed; `coulomb home" in checked(homed_by_drive)
    with Homing(homed_by_drive) as homing:
        found = homing.home(0, method)
    assert (found.joint, found.within_limits) == ("j3", True)
    assert found.position == pytest.approx(0.0, abs=0.07), "within one turn of the motor of its home"
    assert checked(homed_by_drive) == ""


def test_a_drive_that_says_so_in_its_statusword_is_believed_in_any_mode(homed_by_drive, powered, tmp_path):
    """Bit 9, remote, is always set by the simulated drive, bit 15 never: each stands in for a vendor's bit."""
    mode = powered.nodes[0].drive.image[slot.MODE_DISPLAY]
    for bit, is_homed in ((9, True), (15, False)):
        path = tmp_path / f"bit{bit}.yaml"
        profile = load_profile("simulated").model_copy(update={"homed_bit": bit})
        path.write_text(profile.model_dump_json(exclude_none=True), encoding="utf-8")
        axis = homed_by_drive.axes[0].model_copy(update={"drive": str(path)})
        problems = checked(homed_by_drive.model_copy(update={"axes": (axis,)}))
        assert problems == "" if is_homed else "is not homed" in problems
    assert powered.nodes[0].drive.image[slot.MODE_DISPLAY] == mode


def test_after_homing_the_axis_has_no_power_and_the_drive_watches_nobody(homed_by_drive, powered):
    with Homing(homed_by_drive) as homing:
        homing.home(0, 37)
    node = powered.nodes[0]
    assert node.drive.machine.state is State.SWITCH_ON_DISABLED
    assert node.master_heartbeat is None


def test_an_interrupted_homing_brings_the_axis_to_rest(homed_by_drive, powered, monkeypatch):
    moving = threading.Event()
    with Homing(homed_by_drive) as homing:
        drive = homing._drives.drives[0]
        asked = drive.statusword

        def interrupted() -> int:
            word = asked()
            if powered.nodes[0].drive.homing and not moving.is_set():
                moving.set()
                raise KeyboardInterrupt
            return word

        monkeypatch.setattr(drive, "statusword", interrupted)
        with pytest.raises(KeyboardInterrupt):
            homing.home(0, 34)
        monkeypatch.undo()
        assert moving.is_set()
        assert drive.state() is State.SWITCH_ON_DISABLED
        first = drive.position()
        assert drive.position() == first


def test_a_fault_is_reset_with_its_reason_and_only_where_there_is_one(homed_by_drive, powered):
    with Homing(homed_by_drive) as homing:
        assert homing.reset_faults() == []
        powered.nodes[0].drive.fail(0x4310)
        with pytest.raises(DriveError):
            homing.home(0, 37)
        (words,) = homing.reset_faults()
        assert "joint j3 (node 3): fault reset; it was" in words
        assert "0x4310" in words
        assert homing.home(0, 37).within_limits


def test_joints_are_named_or_those_that_their_drive_homes(rig, homed_by_drive):
    assert joints_to_home(homed_by_drive) == [0]
    assert joints_to_home(homed_by_drive, ("j3",)) == [0]
    with pytest.raises(InputError, match="no axis has `homing: drive`"):
        joints_to_home(rig)
    with pytest.raises(InputError, match="joint j9: rig rx130l-joint3-simulated has j3"):
        joints_to_home(rig, ("j9",))
