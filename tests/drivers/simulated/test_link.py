"""What the simulated nodes hear and say over SocketCAN, frame by frame as linux/can.h lays them out, and in this process."""

import queue
import socket
import struct
from contextlib import suppress
from types import SimpleNamespace

import pytest

from drivers.bus import BusSettings, open_bus
from drivers.errors import BusError
from drivers.simulated import link
from drivers.simulated.link import InProcessLink, SocketCanLink, open_link

EXTENDED, REMOTE, ERROR = 0x80000000, 0x40000000, 0x20000000
"""CAN_EFF_FLAG, CAN_RTR_FLAG, CAN_ERR_FLAG of linux/can.h"""
PATIENCE = 60.0


def frame(can_id: int, data: bytes = b"") -> bytes:
    """struct can_frame: id and flags, length, three bytes of padding, eight of data."""
    return struct.pack("<I", can_id) + bytes([len(data), 0, 0, 0]) + data.ljust(8, b"\0")


@pytest.fixture
def wire(monkeypatch):
    """The other end of the socket that a SocketCanLink opens, and the interface that it was bound to."""
    ours, theirs = socket.socketpair(socket.AF_UNIX, socket.SOCK_SEQPACKET)
    bound = []

    class Raw(socket.socket):
        def bind(self, address):
            bound.append(address)

    def raw(*kind):
        assert kind == (socket.AF_CAN, socket.SOCK_RAW, socket.CAN_RAW)
        return Raw(fileno=theirs.detach())

    names = {name: getattr(socket, name) for name in dir(socket) if name.isupper()}
    monkeypatch.setattr(link, "socket", SimpleNamespace(**names, socket=raw))
    monkeypatch.setattr(link, "check_network_interface", lambda channel: None)
    ours.settimeout(PATIENCE)
    with ours:
        yield SimpleNamespace(end=ours, bound=bound)


@pytest.fixture
def heard():
    return queue.Queue()


@pytest.fixture
def listening(wire, heard):
    """A link on the wire; what it hears goes into the queue."""
    opened = open_link(BusSettings(interface="socketcan", channel="can7"))
    opened.start(lambda can_id, data: heard.put((can_id, data)), lambda can_id: heard.put((can_id, "remote")))
    yield opened
    opened.close()


def test_a_frame_is_sent_as_the_kernel_lays_it_out(wire, listening):
    assert wire.bound == [("can7",)]
    listening.send(0x183, b"\x01\x02\x03")
    listening.send(0x7FF, bytes(range(8)))
    assert wire.end.recv(64) == frame(0x183, b"\x01\x02\x03")
    assert wire.end.recv(64) == frame(0x7FF, bytes(range(8)))


def test_data_and_remote_frames_of_11_bits_are_heard_and_nothing_else(wire, listening, heard):
    for other in (
        frame(0x123 | EXTENDED, b"x"),
        frame(0x703 | REMOTE | EXTENDED),
        frame(0x40 | ERROR, bytes(8)),
        frame(0x800 | EXTENDED),
    ):
        wire.end.send(other)
    wire.end.send(frame(0x80))
    wire.end.send(frame(0x7FF, b"\xff\x00"))
    wire.end.send(frame(0x703 | REMOTE))
    wire.end.send(frame(0x000, b"\x01\x03"))
    got = [heard.get(timeout=PATIENCE) for _ in range(4)]
    assert got == [(0x80, b""), (0x7FF, b"\xff\x00"), (0x703, "remote"), (0x000, b"\x01\x03")]


def test_silence_is_waited_out_and_closing_waits_for_no_more_than_a_tenth_of_a_second(
    wire, monkeypatch, heard
):
    assert struct.unpack("@ll", link._RECEIVE_TIMEOUT) == (0, 100_000)
    timeouts = iter([BlockingIOError, BlockingIOError, frame(0x80), OSError])
    opened = SocketCanLink("can7")

    def recv(size):
        assert size == 16
        answer = next(timeouts)
        if isinstance(answer, bytes):
            return answer
        raise answer

    with opened._socket:
        kernel = struct.unpack("@ll", opened._socket.getsockopt(socket.SOL_SOCKET, socket.SO_RCVTIMEO, 16))
        assert kernel == (0, 100_000)
        monkeypatch.setattr(opened, "_socket", SimpleNamespace(recv=recv, close=lambda: None))
        opened._receive(lambda can_id, data: heard.put(can_id), heard.put)
        assert heard.get_nowait() == 0x80
        assert next(timeouts, None) is None


def test_a_full_transmit_queue_loses_the_frame_and_stops_nobody(wire, listening):
    for _ in range(5000):
        listening.send(0x183, bytes(8))
    wire.end.setblocking(False)
    sent = 0
    with suppress(BlockingIOError):
        while wire.end.recv(64):
            sent += 1
    assert 0 < sent < 5000


def test_a_link_that_was_closed_receives_no_more(wire, listening, heard):
    listening.close()
    assert not listening._thread.is_alive()
    with pytest.raises(OSError, match="Bad file descriptor"):
        listening._socket.getsockopt(socket.SOL_SOCKET, socket.SO_TYPE)


def test_an_interface_that_cannot_be_opened_is_named(monkeypatch):
    def refused(*kind):
        raise OSError(1, "Operation not permitted")

    monkeypatch.setattr(link, "check_network_interface", lambda channel: None)
    monkeypatch.setattr(link.socket, "socket", refused)
    with pytest.raises(BusError, match="CAN interface 'can7': "):
        SocketCanLink("can7")


def test_on_the_virtual_bus_the_sender_s_thread_serves_the_node(heard):
    settings = BusSettings(interface="virtual", channel="link-of-these-tests")
    opened = open_link(settings)
    assert isinstance(opened, InProcessLink)
    with open_bus(settings) as other:
        opened.start(
            lambda can_id, data: heard.put((can_id, data)), lambda can_id: heard.put((can_id, "remote"))
        )
        other.send_frame(0x203, b"\x07")
        assert heard.get_nowait() == (0x203, b"\x07")
        opened.send(0x183, b"\x08")
        assert [(can_id, data) for _, can_id, data, _ in other.take()] == [(0x183, b"\x08")]
        opened.close()
        other.send_frame(0x203, b"\x09")
        assert heard.empty()
