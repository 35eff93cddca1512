"""Cyclic torque mode over the kernel's CAN: an arm that is held over the bus stops by itself when nobody is left."""

import os
import pickle
import signal
import struct
import subprocess
import sys
import time
from pathlib import Path

import can
import numpy as np
import pytest
import yaml

from daq.excitation.standard_plan import standard_plan
from daq.rig import Rig
from drivers.bus import open_bus
from drivers.canopen_network import CanopenNetwork
from drivers.cia402 import Mode, State
from drivers.drive import Drive
from tests.daq import session_parent
from tests.daq.held_over_the_bus import held_over_the_bus

RPDO_TIMEOUT = 0x8250


@pytest.fixture
def rig_file(tmp_path) -> Path:
    """RX130L joint 3 whose drive takes torque alone. Time goes with the drive's answers, so that no busy machine makes it late;
    of all that makes it stop when nobody is left, only its watch over the setpoints is there. Node 3 is another drive's, which is
    on the bus through all of these tests."""
    rig = Rig.load("rx130l-joint3-simulated").model_dump(mode="json", exclude_none=True)
    rig |= {"bus": {"interface": "socketcan", "channel": "vcan0"}}
    rig["axes"][0] |= {"node": 5, "feedforward": "cyclic-torque", "held_by": "brake"}
    rig["supervision"] |= {"heartbeat_timeout": 60.0, "parent_timeout": 60.0}
    rig["simulated"]["sync_timeout"] = 5.0
    rig["simulated"]["drives"][0]["sync_loss"] = "run-on"
    path = tmp_path / "rig.yaml"
    path.write_text(yaml.safe_dump(rig), encoding="utf-8")
    return path


def emergency(listener: can.BusABC, node: int, code: int) -> bool:
    """Whether an EMCY of this code comes; a minute is waited for it."""
    latest = time.monotonic() + 60.0
    while (left := latest - time.monotonic()) > 0.0:
        message = listener.recv(left)
        is_emergency = message is not None and message.arbitration_id == 0x80 + node
        if is_emergency and struct.unpack_from("<H", message.data)[0] == code:
            return True
    return False


def test_an_axis_held_over_the_bus_stops_by_its_drive_s_own_watch_when_every_process_of_ours_is_killed(
    rig_file, drive_on_the_bus, bus, tmp_path
):
    rig = Rig.load(rig_file)
    ahead = tmp_path / "ahead.pickle"
    ahead.write_bytes(pickle.dumps(held_over_the_bus(rig, standard_plan(rig, session_parent.SECONDS))))
    parent = subprocess.Popen(
        [sys.executable, session_parent.__file__, str(tmp_path / "experiment"), str(rig_file), str(ahead)],
        stdout=subprocess.PIPE,
        text=True,
        env=os.environ | {"PYTHONPATH": str(Path(__file__).parents[2])},
    )
    acquisition, recorder = (int(number) for number in parent.stdout.readline().split())
    line = parent.stdout.readline()
    assert line == "moving\n", line
    node = rig.axes[0].node
    # A session whose drive somebody else asks something is stopped: until then the bus is only listened to.
    with open_bus(bus) as listener:
        for process in (parent.pid, acquisition, recorder):
            os.kill(process, signal.SIGKILL)
        parent.wait()
        parent.stdout.close()
        # nobody of us is left who could stop it
        assert emergency(listener, node, RPDO_TIMEOUT)
    with CanopenNetwork(bus) as network:
        drive = Drive(network, node, rig.profiles[0])
        assert drive.mode() == Mode.CYCLIC_SYNCHRONOUS_TORQUE
        while drive.state() is State.QUICK_STOP_ACTIVE:
            pass
        assert drive.state() is State.SWITCH_ON_DISABLED
        rests = [drive.position() for _ in range(20)]
    assert np.ptp(rests) * abs(rig.position_matrix[0, 0]) < 1e-4
