"""A serial adapter that speaks slcan, simulated on a pseudo-terminal, between a drive and its master."""

import os
import pty
import select
import threading
import tty

import can
import pytest

from drivers.bus import BusSettings, open_bus
from drivers.canopen_network import CanopenNetwork
from drivers.cia402 import Mode, State
from drivers.drive import Drive
from drivers.errors import BusError
from drivers.frames import OWN
from drivers.gateway import join
from drivers.receive_python_can import PythonCanReceiver
from drivers.virtual_bus import InProcessBus


class SlcanAdapter:
    """The far end of the serial line: frames in slcan's ASCII to and from a virtual channel."""

    def __init__(self, channel: str):
        self._controller, self._terminal = pty.openpty()
        tty.setraw(self._terminal)
        self.port = os.ttyname(self._terminal)
        self._end, self._ended = os.pipe()
        self._bus = InProcessBus(channel)
        self._bus.serve(self._to_host)
        self._thread = threading.Thread(target=self._serve, daemon=True)
        self._thread.start()

    def _to_host(self, can_id: int, data: bytes) -> None:
        os.write(self._controller, f"t{can_id:03X}{len(data)}{data.hex().upper()}\r".encode())

    def _serve(self) -> None:
        received = b""
        while True:
            ready, _, _ = select.select([self._controller, self._end], [], [])
            if self._end in ready:
                return
            received += os.read(self._controller, 256)
            while b"\r" in received:
                line, received = received.split(b"\r", 1)
                if line.startswith(b"t"):
                    data = bytes.fromhex(line[5:].decode())
                    self._bus.send_frame(int(line[1:4], 16), data)

    def unplug(self) -> None:
        if not self._thread.is_alive():
            return
        os.write(self._ended, b".")
        self._thread.join()
        self._bus.shutdown()
        for descriptor in (self._terminal, self._controller, self._end, self._ended):
            os.close(descriptor)


@pytest.fixture
def adapter(open_bench):
    bench = open_bench()
    plugged = SlcanAdapter(bench.bus.channel)
    yield plugged
    plugged.unplug()


@pytest.fixture
def slcan(adapter):
    return BusSettings(interface="slcan", channel=adapter.port, options={"sleep_after_open": 0.0})


def test_a_drive_is_brought_up_and_streams_over_a_serial_adapter_that_opens_only_once(slcan):
    receiver = PythonCanReceiver(slcan)
    with CanopenNetwork(slcan) as network:
        receiver.open()
        drive = Drive(network, 5)
        drive.produce_heartbeat(0.05)
        stream = drive.map_stream(Mode.CYCLIC_SYNCHRONOUS_POSITION)
        drive.set_nmt_state("OPERATIONAL")
        drive.set_mode(Mode.CYCLIC_SYNCHRONOUS_POSITION)
        drive.enable()
        assert drive.state() is State.OPERATION_ENABLED
        receiver.read()
        answered = threading.Event()
        with_answer = open_bus(slcan)
        assert isinstance(with_answer, InProcessBus)
        with_answer.serve(lambda can_id, data: answered.set() if can_id == 0x185 else None)
        receiver.send(0x80, b"")
        assert answered.wait(5.0)
        with_answer.shutdown()
        block = receiver.read()
        seen = [int(can_id) for can_id in block["can_id"] if can_id in (0x80, *stream.transmit_ids)]
        assert seen == [0x80, 0x185]
        assert block[block["can_id"] == 0x80]["flags"].tolist() == [OWN]
        assert "interface slcan" in receiver.clock_source
    receiver.close()


def test_the_adapter_is_closed_by_the_last_and_can_be_opened_again(slcan):
    first, second = open_bus(slcan), open_bus(slcan)
    first.shutdown()
    second.send_frame(0x80, b"")
    second.shutdown()
    second.shutdown()
    again = open_bus(slcan)
    again.send_frame(0x80, b"")
    again.shutdown()


class _CountedBus(InProcessBus):
    """An adapter that knows whether it was closed."""

    closed = 0

    def shutdown(self) -> None:
        self.closed += 1
        super().shutdown()


def test_the_adapter_is_closed_when_the_last_of_three_has_left_and_not_before():
    opened = []

    def adapter() -> can.BusABC:
        opened.append(_CountedBus("far end"))
        return opened[-1]

    members = [join("counted", "test", "counted", adapter) for _ in range(3)]
    (bus,) = opened
    for member in members:
        assert bus.closed == 0
        member.shutdown()
        member.shutdown()
    assert bus.closed == 1
    join("counted", "test", "counted", adapter).shutdown()
    assert [each.closed for each in opened] == [1, 1]


def test_an_adapter_that_is_unplugged_is_an_error_for_everybody(adapter, slcan):
    receiver = PythonCanReceiver(slcan)
    receiver.open()
    other = open_bus(slcan)
    adapter.unplug()
    with pytest.raises(Exception, match="the adapter is gone"):
        other.recv(10.0)
    with pytest.raises(BusError, match="the adapter is gone"):
        receiver.read()
    with pytest.raises(BusError, match="the adapter is gone"):
        receiver.send(0x80, b"")
    other.shutdown()
    receiver.close()


def test_a_bus_over_multicast_that_echoes_our_frames_shows_each_frame_once_and_those_of_others():
    """python-can's udp_multicast gives back what it sent, unmarked; equal frames of others must still come through."""
    settings = BusSettings(
        interface="udp_multicast", channel="239.74.163.2", options={"port": 43_189, "hop_limit": 0}
    )
    receiver = PythonCanReceiver(settings)
    receiver.open()
    options = settings.options | {"ignore_config": True}
    try:
        with can.Bus(interface=settings.interface, channel=settings.channel, **options) as other:
            for number in range(20):
                receiver.send(0x80, b"")
                receiver.send(0x205, bytes((number,)))
            other.send(can.Message(arbitration_id=0x80, is_extended_id=False))
            other.send(can.Message(arbitration_id=0x7FF, is_extended_id=False))
            frames = []
            for _attempt in range(500):
                frames += [(int(f["can_id"]), bool(f["flags"] & OWN)) for f in receiver.read()]
                if (0x7FF, False) in frames:
                    break
                receiver.wait(0.02)
    finally:
        receiver.close()
    assert frames.count((0x80, True)) == 20
    assert frames.count((0x205, True)) == 20
    assert frames.count((0x205, False)) == 0
    assert frames.count((0x80, False)) == 1


def test_two_networks_that_differ_in_their_port_alone_are_two_adapters():
    def network(port):
        return BusSettings(
            interface="udp_multicast", channel="239.74.163.2", options={"port": port, "hop_limit": 0}
        )

    first, second = open_bus(network(43_187)), open_bus(network(43_188))
    with can.Bus(interface="udp_multicast", channel="239.74.163.2", port=43_188, hop_limit=0) as other:
        first.send_frame(0x205, b"1")
        second.send_frame(0x206, b"2")
        heard = other.recv(10.0)
    first.shutdown()
    second.shutdown()
    assert heard is not None
    assert heard.arbitration_id == 0x206
