"""Two drives with the same node id are told before anything is written to them."""

import can
import pytest

from daq.rig import Rig
from daq.rig_check import check_rig
from daq.rig_drives import RigDrives
from tests.drivers.foreign_stacks.durand_drive import DurandDrive

RIG = """
name: twins
cycle: 0.01
bus: {interface: virtual, channel: twins}
robot:
  gravity: [0.0, -9.81, 0.0]
  joints: [{name: j1, type: revolute}]
axes:
  - joint: j1
    node: 11
    encoder_counts: 4096
    torque_constant: 0.5
    rated_torque: 2.5
    limits: {position: [-9, 9], velocity: 2, acceleration: 6, jerk: 100, current: 15, following_error: 0.1}
"""


@pytest.fixture
def rig(tmp_path):
    (tmp_path / "rig.yaml").write_text(RIG)
    return Rig.load(tmp_path / "rig.yaml")


@pytest.fixture
def plugged_in(rig):
    """Puts drives of another stack on the bus, all with node id 11: plugged_in(count)."""
    drives = []

    def plug_in(count):
        for _each in range(count):
            drives.append(DurandDrive(can.Bus(interface="virtual", channel=rig.bus.channel), 11))
        return drives

    yield plug_in
    for drive in drives:
        drive.close()


@pytest.mark.parametrize("count", [1, 2, 3])
def test_the_check_says_so_and_writes_nothing(rig, plugged_in, count):
    drives = plugged_in(count)
    checking = RigDrives(rig, "a check")
    try:
        checked = check_rig(checking)
    finally:
        found = [drive.objects.read(0x1017, 0) for drive in drives]
        checking.close()
    if count == 1:
        assert checked.ok, checked.problems
        return
    assert "two nodes answer under node id 11" in checked.problems
    assert found == [0] * count
