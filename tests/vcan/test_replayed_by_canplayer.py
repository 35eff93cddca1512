"""A recorded raw log, put back on the bus by somebody else: canplayer of can-utils."""

import shutil
import socket
import struct
import subprocess

import numpy as np
import pytest

from daq.raw_log import RawLog
from drivers.frames import FRAME

FRAMES = 1000
FREE, MASK = 0x680, 0x780
"""Identifiers 0x680 to 0x6FF: no node of CiA 301's predefined connection set sends or answers them, so that a drive of
another test on the same bus neither mixes in nor replies."""
_CAN_FRAME = struct.Struct("<IB3x8s")


@pytest.fixture
def raw_log(tmp_path):
    """A raw log of a thousand frames of all lengths, as a recording writes it; its path and its frames."""
    if shutil.which("canplayer") is None:
        pytest.skip("canplayer is not installed (Debian package can-utils)")
    random = np.random.default_rng(20260101)
    frames = np.zeros(FRAMES, FRAME)
    frames["stamp"] = 1_700_000_000_000_000_000 + 1_000_000 * np.arange(FRAMES)
    frames["can_id"] = random.integers(FREE, FREE + 0x80, FRAMES)
    frames["length"] = np.arange(FRAMES) % 9
    expected = []
    for index in range(FRAMES):
        data = random.bytes(int(frames["length"][index]))
        frames["data"][index, : len(data)] = np.frombuffer(data, np.uint8)
        expected.append((int(frames["can_id"][index]), data))
    log = RawLog(tmp_path / "session.log", "vcan0")
    log.append(frames)
    log.close()
    return log.path, expected


def test_every_frame_of_a_raw_log_comes_back_from_the_bus(raw_log):
    path, expected = raw_log
    with socket.socket(socket.AF_CAN, socket.SOCK_RAW, socket.CAN_RAW) as listener:
        listener.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, 1 << 20)
        listener.setsockopt(socket.SOL_CAN_RAW, socket.CAN_RAW_FILTER, struct.pack("=II", FREE, MASK))
        listener.bind(("vcan0",))
        listener.settimeout(30)
        # at the pace of the stamps, a second in all
        player = subprocess.Popen(["canplayer", "-I", str(path)])
        try:
            heard = [_CAN_FRAME.unpack(listener.recv(16)) for _ in expected]
        finally:
            assert player.wait(30) == 0
    assert [(can_id, data[:length]) for can_id, length, data in heard] == expected
