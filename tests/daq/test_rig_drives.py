"""The drives of a rig over their network: what they send and take, what they complain of, and how they are left."""

import pickle

import numpy as np
import pytest

from daq.rig_drives import MASTER_NODE, RESTARTED, RigDrives, take_power
from daq.safety import StopCause
from drivers.bus import BusSettings, open_bus
from drivers.cia402 import Command, Mode, State
from drivers.emergency import Emergency
from drivers.process_data import TARGET_TORQUE
from drivers.simulated import process_image as slot
from tests.drivers.refused_writes import refuse_writes


@pytest.fixture
def drives(still_rig, powered):
    taken = RigDrives(still_rig)
    yield taken
    taken.close()


def test_positions_are_the_counts_through_the_rigs_matrix_and_offset(still_rig, powered, drives):
    powered.nodes[0].drive.image[slot.POSITION] = 4321
    by_hand = still_rig.position_matrix[0, 0] * 4321 + still_rig.position_offset[0]
    np.testing.assert_allclose(drives.positions(), [by_hand], rtol=1e-12)


def test_configured_drives_have_the_mode_and_the_cycle_and_no_power(still_rig, powered, drives):
    (stream,) = drives.configure()
    (node,) = powered.nodes
    assert node.drive.image[slot.MODE] == 8
    assert node.period == pytest.approx(still_rig.cycle)
    assert not node.drive.machine.enabled
    assert stream.node == node.node
    drives.drives[0].produce_heartbeat(0.1)
    drives.stream()
    assert node.nmt_state == 5


def test_our_sign_of_life_is_the_heartbeat_of_our_own_node_in_operational(still_rig, drives):
    with open_bus(still_rig.bus) as bus:
        drives.heartbeat()
        message = bus.recv(1.0)
    assert (message.arbitration_id, bytes(message.data)) == (0x700 + MASTER_NODE, b"\x05")


def test_emergencies_are_told_oldest_first_once_and_without_the_word_that_an_error_has_gone(drives):
    watch = drives.drives[0].watch
    assert drives.emergency() is None
    for code in (0x4310, 0, 0x8611):
        watch.on_emergency(Emergency(drives.drives[0].node, code, 0, b"", 0.0))
    first, second = drives.emergency(), drives.trouble()
    assert first is not None
    assert second is not None
    assert first.cause is second.cause is StopCause.EMERGENCY
    assert first.words.startswith("joint j3 (node 3): EMCY 0x4310")
    assert "0x8611" in second.words
    assert drives.trouble() is None


def test_a_restart_is_told_once(powered, drives):
    drive = drives.drives[0]
    drive.expect_no_restart()
    assert drives.restart() is None
    powered.nodes[0].boot()
    assert drive.watch.wait_for(lambda: drive.restarted, 60.0)
    told = drives.trouble()
    assert told is not None
    assert (told.cause, told.words) == (StopCause.RESTARTED, f"joint j3 (node 3): {RESTARTED}")
    assert drives.trouble() is None


def test_drives_are_left_silent_and_where_they_answer(still_rig, powered):
    drives = RigDrives(still_rig)
    drives.drives[0].produce_heartbeat(0.1)
    drives.stream()
    drives.close()
    (node,) = powered.nodes
    assert (node.nmt_state, node.heartbeat_period) == (127, 0.0)


OWN_WATCH = 0x0001_01F4
"""0x1016:01 of a drive that watches node 1, its machine's controller, for 500 ms"""


def watching_its_own_master(rig):
    """Its drive as it was before anybody of ours came."""
    drives = RigDrives(rig)
    with drives.drives[0].sdo.lasting():
        drives.drives[0].sdo.write(0x1016, 1, "uint32", OWN_WATCH)
        drives.drives[0].sdo.write(0x1017, 0, "uint16", 700)
    drives.close()


def master_watch(rig):
    drives = RigDrives(rig)
    (drive,) = drives.drives
    watch = drive.sdo.read(0x1016, 1, "uint32"), drive.sdo.read(0x1017, 0, "uint16")
    drives.close()
    return watch


def set_up(rig):
    drives = RigDrives(rig)
    drives.configure()
    drives.drives[0].produce_heartbeat(0.1)
    drives.drives[0].watch_master(MASTER_NODE, 0.3)
    return drives


def test_drives_get_back_what_they_held_before_a_session(still_rig, powered):
    watching_its_own_master(still_rig)
    drives = set_up(still_rig)
    assert drives.drives[0].sdo.read(0x1016, 1, "uint32") == MASTER_NODE << 16 | 300
    assert drives.close() == []
    assert master_watch(still_rig) == (OWN_WATCH, 700)


def test_drives_of_a_process_that_died_get_back_what_it_had_kept(still_rig, powered):
    watching_its_own_master(still_rig)
    dead = set_up(still_rig)
    kept = pickle.loads(pickle.dumps(dead.held_before()))
    dead.network.close()
    dead._claim.close()
    assert master_watch(still_rig) == (MASTER_NODE << 16 | 300, 100)
    assert take_power(still_rig, kept).off
    assert master_watch(still_rig) == (OWN_WATCH, 700)


def test_what_cannot_be_put_back_is_said_by_joint(still_rig, powered, monkeypatch):
    drives = set_up(still_rig)
    refuse_writes(monkeypatch, drives.drives[0], 0x1017)
    assert drives.close() == ["joint j3 (node 3): it keeps 0x1017:00"]


def test_a_drive_that_is_silent_when_it_is_left_is_said(still_rig, powered):
    drives = set_up(still_rig)
    powered.nodes[0].faults.frozen = True
    (left,) = drives.close()
    assert left.startswith("joint j3 (node 3): node 3: ")
    assert "no answer" in left


@pytest.mark.parametrize(
    ("touch", "left"),
    [
        (lambda drive: drive.state(), State.OPERATION_ENABLED),
        (lambda drive: drive.produce_heartbeat(0.1), State.SWITCH_ON_DISABLED),
        (
            lambda drive: (drive.produce_heartbeat(0.1), drive.set_nmt_state("OPERATIONAL")),
            State.SWITCH_ON_DISABLED,
        ),
        (lambda drive: drive.quick_stop_at_once(), State.SWITCH_ON_DISABLED),
    ],
    ids=["read", "written", "NMT", "asked at once"],
)
def test_power_is_taken_on_leaving_from_a_drive_that_was_touched_and_from_no_other(
    still_rig, powered, touch, left
):
    (node,) = powered.nodes
    for command in (Command.SHUTDOWN, Command.SWITCH_ON, Command.ENABLE_OPERATION):
        node.drive.image[slot.CONTROLWORD] = command.value
        node.drive.take_controlword()
    drives = RigDrives(still_rig)
    touch(drives.drives[0])
    drives.close()
    assert node.drive.machine.state is left


def in_torque_mode(node, torque: int) -> None:
    """A drive with power that takes a torque, as a session in torque mode has it."""
    image = node.drive.image
    image[slot.MODE] = int(Mode.CYCLIC_SYNCHRONOUS_TORQUE)
    node.drive.take_mode()
    for command in (Command.SHUTDOWN, Command.SWITCH_ON, Command.ENABLE_OPERATION):
        image[slot.CONTROLWORD] = command.value
        node.drive.take_controlword()
    image[slot.TARGET_TORQUE] = torque
    assert node.drive.machine.enabled


def test_a_stopped_session_leaves_no_drive_in_torque_mode_and_the_next_one_starts_as_the_first(
    still_rig, powered
):
    (node,) = powered.nodes
    for _ in range(2):
        drives = RigDrives(still_rig)
        drives.configure(TARGET_TORQUE)
        (drive,) = drives.drives
        before = drive.sdo.read(0x1400, 5, "uint16", "looking")
        assert before == 20  # ms, of the rig file
        in_torque_mode(node, 250)
        drives.close()
        image = node.drive.image
        assert not node.drive.machine.enabled
        assert (image[slot.MODE_DISPLAY], image[slot.TARGET_TORQUE]) == (8, 0)
        looking = RigDrives(still_rig)
        assert looking.drives[0].sdo.read(0x1400, 5, "uint16", "looking") == 0
        looking.close()


def test_a_drive_whose_session_was_killed_in_torque_mode_is_put_back_by_who_takes_its_power(
    still_rig, powered
):
    (node,) = powered.nodes
    in_torque_mode(node, -300)
    assert take_power(still_rig).off
    assert (node.drive.image[slot.MODE_DISPLAY], node.drive.image[slot.TARGET_TORQUE]) == (8, 0)


def test_power_is_taken_from_a_drive_whose_master_has_gone(still_rig, powered):
    node = powered.nodes[0]
    for command in (Command.SHUTDOWN, Command.SWITCH_ON, Command.ENABLE_OPERATION):
        node.drive.image[slot.CONTROLWORD] = command.value
        node.drive.take_controlword()
    assert node.drive.machine.state is State.OPERATION_ENABLED
    report = take_power(still_rig)
    assert report.off
    assert report.alarm == ""
    assert not node.drive.machine.enabled


def test_what_keeps_power_from_being_taken_is_in_the_report(rig):
    report = take_power(
        rig.model_copy(update={"bus": BusSettings(interface="socketcan", channel="none-such")})
    )
    assert not report.off
    assert report.alarm.startswith("power could not be read back as off (joint j3 (node 3): ")
    assert "none-such" in report.alarm
    assert report.alarm.endswith("press the emergency stop")
