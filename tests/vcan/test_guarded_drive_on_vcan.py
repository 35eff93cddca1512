"""Node guarding over the kernel's CAN: remote frames go out as such, and the drive misses them when they end."""

import socket
import struct

import numpy as np
import pytest

from drivers.canopen_network import CanopenNetwork
from drivers.drive import Drive, Timeouts
from drivers.errors import DriveError
from drivers.simulated.oddities import OdditySettings
from drivers.simulated.rig import SimulatedRig
from drivers.simulated.settings import SimulatedAxis, SimulatedDrivesSettings

NODE = 44
REMOTE_FRAME = (0x700 + NODE) | socket.CAN_RTR_FLAG


class Still:
    """A mechanism that does not move."""

    axes = 1
    motor_angle = np.zeros(1)
    temperature = np.full(1, 25.0)

    def reset(self, seed):
        """It stays as it is."""

    def step(self, motor_current, duration):
        """It stays where it is."""


@pytest.fixture
def drive(bus):
    odd = SimulatedAxis(node=NODE, oddities=OdditySettings(node_guarding_only=True))
    with (
        SimulatedRig(SimulatedDrivesSettings(axes=(odd,)), bus, Still()),
        CanopenNetwork(bus) as network,
    ):
        yield Drive(network, NODE, timeouts=Timeouts(sdo=0.5))


def test_a_drive_without_heartbeat_answers_remote_frames_and_misses_them(drive):
    with socket.socket(socket.AF_CAN, socket.SOCK_RAW, socket.CAN_RAW) as listener:
        listener.bind(("vcan0",))
        listener.settimeout(5.0)
        drive.produce_heartbeat(0.1)
        can_id, length, _ = struct.unpack("<IB3x8s", listener.recv(16))
        while can_id != REMOTE_FRAME:
            can_id, length, _ = struct.unpack("<IB3x8s", listener.recv(16))
        assert length == 1
    drive.set_nmt_state("PRE-OPERATIONAL")
    assert drive.watch.toggle.repeated == 0
    drive.disable()
    drive.enable()
    drive.watch_master(127, 0.2)
    drive.ask_if_alive()
    assert drive.watch.wait_for(lambda: any(each.code == 0x8130 for each in drive.emergencies), 20.0)
    with pytest.raises(DriveError, match="0x8130"):
        drive.enable()
