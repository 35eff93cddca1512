"""Who else is on the bus is found by the check, before anything is sent there."""

import threading

import pytest

from daq.rig import Rig
from daq.rig_check import check_rig
from daq.rig_drives import RigDrives
from daq.simulated_rig import simulated_rig
from drivers.bus import open_bus
from drivers.cia402 import Command, State
from drivers.simulated import process_image as slot


def checked_beside(rig: Rig, can_id: int):
    """The check of a rig, whose drive moves an axis, while somebody else sends a frame over and over."""
    ended = threading.Event()
    with simulated_rig(rig, rig.payload("none")) as on, open_bus(rig.bus) as stranger:
        (node,) = on.nodes
        for command in (Command.SHUTDOWN, Command.SWITCH_ON, Command.ENABLE_OPERATION):
            node.drive.image[slot.CONTROLWORD] = command.value
            node.drive.take_controlword()
        node.take_nmt(1, node.node)

        def send() -> None:
            while not ended.wait(0.005):
                stranger.send_frame(can_id, b"\x05")

        thread = threading.Thread(target=send)
        drives = RigDrives(rig)
        thread.start()
        try:
            return check_rig(drives)
        finally:
            ended.set()
            thread.join()
            drives.close()
            assert (node.nmt_state, node.drive.machine.state) == (5, State.OPERATION_ENABLED)
            assert [frame for frame in stranger.take() if frame[1] == 0 or frame[1] & 0x780 == 0x600] == []


@pytest.mark.parametrize(
    ("can_id", "words"),
    [
        (0x080, "another master is active on"),
        (0x203, "it sends setpoints 0x203; nothing was sent"),
        (0x77F, "a node with id 127 is on"),
    ],
)
def test_a_second_master_or_a_node_with_our_id_is_named(rig, can_id, words):
    check = checked_beside(rig, can_id)
    assert not check.ok
    assert words in check.problems
    assert "\n" not in check.problems
