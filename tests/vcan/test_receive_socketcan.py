import shutil
import socket
import struct
import subprocess
import time
from pathlib import Path

import numpy as np
import pytest

from drivers import frames
from drivers.bus import pass_ids
from drivers.errors import BusError
from drivers.frames import column
from drivers.receive_socketcan import BLOCK, SocketCanReceiver


@pytest.fixture
def receiver():
    opened = []

    def make(*arguments, **keywords):
        opened.append(SocketCanReceiver("vcan0", *arguments, **keywords))
        opened[-1].open()
        return opened[-1]

    yield make
    for each in opened:
        each.close()


def test_frames_arrive_in_order_complete_and_stamped_by_the_kernel(receiver, send_raw):
    receive = receiver(pass_ids([0x181]))
    before = time.time_ns()
    for number in range(3 * BLOCK + 7):
        send_raw(0x181, struct.pack("<q", number))
    after = time.time_ns()
    block = receive.read()
    assert column(block, 0, "<i8").tolist() == list(range(3 * BLOCK + 7))
    assert (np.diff(block["stamp"]) >= 0).all()
    assert before <= block["stamp"][0] <= block["stamp"][-1] <= after
    assert set(block["length"]) == {8}
    assert len(receive.read()) == 0
    assert receive.dropped == 0


def test_the_kernel_keeps_what_is_not_asked_for_away(receiver, send_raw):
    receive = receiver(pass_ids([0x80, 0x181]))
    for can_id in (0x181, 0x182, 0x80, 0x581, 0x701):
        send_raw(can_id, b"")
    send_raw(0x181 | socket.CAN_EFF_FLAG, b"")
    assert receive.read()["can_id"].tolist() == [0x181, 0x80]


def test_our_own_sync_is_among_the_frames_and_flagged(receiver, send_raw):
    receive = receiver()
    receive.send(0x80, b"")
    send_raw(0x181, b"\x01")
    receive.send(0x80, b"")
    block = receive.read()
    assert block["can_id"].tolist() == [0x80, 0x181, 0x80]
    assert ((block["flags"] & frames.OWN) != 0).tolist() == [True, False, True]


def test_flags_of_unusual_frames_are_told(receiver, send_raw):
    receive = receiver()
    send_raw(0x12345678 | socket.CAN_EFF_FLAG, b"ab")
    send_raw(0x701 | socket.CAN_RTR_FLAG, b"")
    block = receive.read()
    assert block["can_id"].tolist() == [0x12345678, 0x701]
    assert block["flags"].tolist() == [frames.EXTENDED, frames.REMOTE]


def test_lost_frames_are_counted_exactly(receiver, send_raw):
    """A buffer for few frames is overrun; what was received and what was dropped add up to what was sent."""
    receive = receiver(pass_ids([0x181]), receive_buffer=4096)
    sent = 500
    for number in range(sent):
        send_raw(0x181, struct.pack("<q", number))
    received = column(receive.read(), 0, "<i8").tolist()
    assert received == list(range(len(received)))
    # The count travels with the next frame that gets through.
    send_raw(0x181, struct.pack("<q", sent))
    assert column(receive.read(), 0, "<i8").tolist() == [sent]
    assert 0 < receive.dropped == sent - len(received)


def test_the_buffer_holds_more_than_a_second_of_a_full_bus(receiver, send_raw):
    receive = receiver(pass_ids([0x181]))
    for _ in range(9009):
        send_raw(0x181, b"\x00" * 8)
    assert len(receive.read()) == 9009
    assert receive.dropped == 0


def test_can_fd_frames_and_classic_ones_share_a_block(receiver):
    if int(Path("/sys/class/net/vcan0/mtu").read_text()) < 72:
        pytest.skip("vcan0 carries classic frames only (mtu below 72)")
    receive = receiver(fd=True)
    with socket.socket(socket.AF_CAN, socket.SOCK_RAW, socket.CAN_RAW) as raw:
        raw.setsockopt(socket.SOL_CAN_RAW, socket.CAN_RAW_FD_FRAMES, 1)
        raw.bind(("vcan0",))
        raw.send(struct.pack("<IBBxx64s", 0x181, 64, 0x01, bytes(range(64))))
        raw.send(struct.pack("<IB3x8s", 0x182, 2, b"ab"))
    block = receive.read()
    assert block["can_id"].tolist() == [0x181, 0x182]
    assert block["flags"].tolist() == [frames.FD | frames.BITRATE_SWITCH, 0]
    assert block["length"].tolist() == [64, 2]
    assert bytes(block["data"][0]) == bytes(range(64))
    assert bytes(block["data"][1]) == b"ab" + bytes(62)


def test_an_interface_that_goes_down_is_an_error_not_silence(receiver):
    if shutil.which("ip") is None:
        pytest.skip("iproute2 is not installed")
    made = subprocess.run(
        ["ip", "link", "add", "dev", "vcan9", "type", "vcan"], capture_output=True, text=True
    )
    if made.returncode:
        pytest.skip(f"a further vcan cannot be made here: {made.stderr.strip()}")
    try:
        with pytest.raises(BusError, match="'vcan9' is down"):
            SocketCanReceiver("vcan9").open()
        subprocess.run(["ip", "link", "set", "vcan9", "up"], check=True)
        receive = SocketCanReceiver("vcan9")
        receive.open()
        assert len(receive.read()) == 0
        subprocess.run(["ip", "link", "set", "vcan9", "down"], check=True)
        with pytest.raises(BusError, match="the channel is down"):
            receive.read()
        receive.close()
    finally:
        subprocess.run(["ip", "link", "delete", "vcan9"], check=True)


def test_reading_before_open_is_refused():
    with pytest.raises(BusError, match="is not open"):
        SocketCanReceiver("vcan0").read()
