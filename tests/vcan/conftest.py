"""Fixtures on a real SocketCAN interface vcan0; run through tests/with-vcan."""

import os
import signal
import socket
import struct
import subprocess
import sys
from collections.abc import Callable, Iterator
from pathlib import Path

import pytest

from drivers.bus import BusSettings, check_network_interface
from drivers.errors import BusError

CHANNEL = "vcan0"
NODE = 3
_CAN_FRAME = struct.Struct("<IB3x8s")
_HERE = Path(__file__).parent

# The fake drive of these tests: a light arm, so that a bring-up does not have to wait for heavy motion.
RIG = """
name: vcan-arm
cycle: 0.002
bus: {interface: socketcan, channel: vcan0}
robot:
  gravity: [0.0, -9.81, 0.0]
  joints: [{name: j1, type: revolute}]
axes:
  - joint: j1
    node: 3
    drive: simulated
    encoder_counts: 65536
    gear_ratio: 50.0
    torque_constant: 0.2
    rated_torque: 1.0
    limits: {position: [-3, 3], velocity: 2, acceleration: 10, jerk: 200, current: 15, following_error: 0.1}
simulated:
  sync_timeout: 2.0
  plant:
    kind: arm
    gravity: [0.0, -9.81, 0.0]
    link: {inertia: 0.5, first_moment: [0.5, 0.0]}
    axis:
      motor: {gear_ratio: 50.0, torque_constant: 0.2, rotor_inertia: 0.0005}
      friction: {viscous: 2.0}
      start_position: 0.06  # half a turn of the motor: on an index pulse a homing would end as soon as the brake opens
  drives:
    - servo: {position_gain: 30.0, velocity_gain: 0.5, velocity_integral: 5.0}
"""


def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    """Everything here needs vcan0; without one it is skipped, with the reason."""
    try:
        check_network_interface(CHANNEL)
        missing = None
    except BusError as error:
        missing = pytest.mark.skip(reason=f"{error}; run through tests/with-vcan")
    for item in items:
        if _HERE in item.path.parents:
            item.add_marker(pytest.mark.vcan)
            if missing is not None:
                item.add_marker(missing)


@pytest.fixture
def send_raw() -> Iterator[Callable[[int, bytes], None]]:
    """Puts a frame on vcan0 from a socket that is not the receiver's: send_raw(can_id, data)."""
    with socket.socket(socket.AF_CAN, socket.SOCK_RAW, socket.CAN_RAW) as raw:
        raw.bind((CHANNEL,))
        yield lambda can_id, data: raw.send(_CAN_FRAME.pack(can_id, len(data), data)) and None


@pytest.fixture(scope="session")
def bus() -> BusSettings:
    """vcan0."""
    return BusSettings(interface="socketcan", channel=CHANNEL)


class FakeDrive:
    """`coulomb fake-drive` in a process of its own."""

    def __init__(self, rig: Path, *options: str):
        self.process = subprocess.Popen(
            [sys.executable, "-m", "api", "fake-drive", str(rig), *options],
            stdout=subprocess.PIPE,
            text=True,
            env=os.environ | {"PYTHONUNBUFFERED": "1"},
        )
        assert self.process.stdout is not None
        self.words = self.process.stdout.readline()
        assert "fake-drive: nodes " in self.words

    def stop(self, seconds: float = 10) -> int:
        self.process.send_signal(signal.SIGTERM)
        status = self.process.wait(seconds)
        assert self.process.stdout is not None
        self.process.stdout.close()
        return status


@pytest.fixture(scope="session")
def fake_drive(tmp_path_factory: pytest.TempPathFactory) -> Iterator[FakeDrive]:
    """Node 3 on vcan0 until the last test has ended; `reset_fault`, NMT reset bring it back to its beginning."""
    rig = tmp_path_factory.mktemp("vcan") / "rig.yaml"
    rig.write_text(RIG, encoding="utf-8")
    drive = FakeDrive(rig)
    assert drive.words.startswith(f"fake-drive: nodes {NODE} on socketcan channel vcan0"), drive.words
    yield drive
    assert drive.stop() == 0


@pytest.fixture
def drive_on_the_bus(rig_file: Path) -> Iterator[None]:
    """The drive of the test module's own `rig_file`, without payload."""
    drive = FakeDrive(rig_file, "--payload", "none")
    yield
    drive.stop(20)
