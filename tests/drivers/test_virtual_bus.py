import threading

import can
import pytest

from drivers.bus import BusSettings, open_bus, pass_ids
from drivers.frames import OWN
from drivers.receive_python_can import PythonCanReceiver
from drivers.sync_producer import SimulatedClock
from drivers.virtual_bus import InProcessBus


@pytest.fixture
def channel(request):
    return f"virtual-{request.node.name}"


@pytest.fixture
def buses(channel):
    opened = []

    def make(**arguments):
        opened.append(InProcessBus(channel, **arguments))
        return opened[-1]

    yield make
    for bus in opened:
        bus.shutdown()


def ids(frames):
    return [can_id for _, can_id, _, _ in frames]


def test_everybody_but_the_sender_hears_a_frame(buses):
    first, second, third = buses(), buses(), buses()
    first.send_frame(0x181, b"\x01\x02")
    assert ids(first.take()) == []
    for other in (second, third):
        ((_, can_id, data, flags),) = other.take()
        assert (can_id, data, flags) == (0x181, b"\x01\x02", 0)


def test_python_can_s_own_virtual_bus_hears_and_is_heard(buses, channel):
    ours = buses()
    with can.Bus(interface="virtual", channel=channel) as theirs:
        theirs.send(can.Message(arbitration_id=0x123, is_extended_id=False, data=b"abc"))
        ours.send(can.Message(arbitration_id=0x321, is_extended_id=False, data=b"de"))
        assert [(frame[1], frame[2]) for frame in ours.take()] == [(0x123, b"abc")]
        received = theirs.recv(1.0)
        assert received is not None
        assert (received.arbitration_id, bytes(received.data)) == (0x321, b"de")


def test_filters_act_at_delivery_and_can_be_changed(buses):
    sender, listener = buses(), buses(can_filters=pass_ids([0x181]))
    for can_id in (0x80, 0x181, 0x182):
        sender.send_frame(can_id, b"")
    assert ids(listener.take()) == [0x181]
    listener.set_filters(pass_ids([0x182]))
    for can_id in (0x80, 0x181, 0x182):
        sender.send_frame(can_id, b"")
    assert ids(listener.take()) == [0x182]


def test_a_served_node_answers_before_send_returns_and_after_the_question(buses):
    master, node, witness = buses(receive_own_messages=True), buses(), buses()
    node.serve(lambda can_id, data: node.send_frame(0x181, data) if can_id == 0x80 else None)
    master.send_frame(0x80, b"\x07")
    assert ids(master.take()) == [0x80, 0x181]
    assert ids(witness.take()) == [0x80, 0x181]


def test_own_frames_come_back_flagged_when_asked_for(buses):
    bus = buses(receive_own_messages=True)
    bus.send_frame(0x80, b"")
    ((_, _, _, flags),) = bus.take()
    assert flags & OWN


def test_a_simulated_clock_stamps_the_frames(buses):
    sender, listener = buses(), buses()
    clock = SimulatedClock()
    sender.use_clock(clock)
    for _ in range(3):
        clock.advance(1_000_000)
        sender.send_frame(0x80, b"")
    assert [stamp for stamp, *_ in listener.take()] == [1_000_000, 2_000_000, 3_000_000]


def test_all_listeners_see_the_same_order_when_threads_send_at_once(buses):
    first, second = buses(), buses()
    senders = [buses() for _ in range(4)]
    start = threading.Barrier(len(senders))

    def send(bus, can_id):
        start.wait()
        for number in range(500):
            bus.send_frame(can_id, number.to_bytes(2, "little"))

    threads = [threading.Thread(target=send, args=(bus, 0x200 + index)) for index, bus in enumerate(senders)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    seen = [(can_id, data) for _, can_id, data, _ in first.take()]
    assert seen == [(can_id, data) for _, can_id, data, _ in second.take()]
    for index in range(len(senders)):
        numbers = [int.from_bytes(data, "little") for can_id, data in seen if can_id == 0x200 + index]
        assert numbers == list(range(500))


def test_delivered_waits_for_a_thread_that_is_held_up_while_it_delivers(buses):
    """A SYNC whose answer comes only after the next SYNC would be a lost sample that nobody lost."""
    master, node, heartbeat = buses(receive_own_messages=True), buses(), buses()
    held, go_on = threading.Event(), threading.Event()

    def handle(can_id, data):
        if can_id == 0x701:
            held.set()
            assert go_on.wait(10)
        elif can_id == 0x80:
            node.send_frame(0x181, data)

    node.serve(handle)
    other = threading.Thread(target=heartbeat.send_frame, args=(0x701, b"\x05"))
    other.start()
    assert held.wait(10)
    master.send_frame(0x80, b"")
    assert not master.delivered(0.01)
    go_on.set()
    assert master.delivered(10)
    master.send_frame(0x80, b"")
    assert master.delivered(10)
    other.join()
    assert ids(master.take()) == [0x701, 0x80, 0x181, 0x80, 0x181]


def test_a_waiting_reader_is_woken(buses):
    sender, listener = buses(), buses()
    received = []
    thread = threading.Thread(target=lambda: received.append(listener.recv(5.0)))
    thread.start()
    sender.send_frame(0x7FF, b"x")
    thread.join(5.0)
    assert received[0].arbitration_id == 0x7FF


def test_recv_returns_none_when_nothing_comes(buses):
    assert buses().recv(0.01) is None


def test_the_receiver_keeps_sync_at_its_place_among_the_answers(channel, buses):
    receiver = PythonCanReceiver(BusSettings(channel=channel))
    receiver.open()
    node = buses()
    node.serve(lambda can_id, data: node.send_frame(0x181, b"\x01" * 8) if can_id == 0x80 else None)
    for _ in range(3):
        receiver.send(0x80, b"")
    block = receiver.read()
    assert block["can_id"].tolist() == [0x80, 0x181] * 3
    assert ((block["flags"] & OWN) != 0).tolist() == [True, False] * 3
    assert block["length"].tolist() == [0, 8] * 3
    assert len(receiver.read()) == 0
    receiver.close()


def test_the_virtual_interface_of_the_settings_is_this_bus(channel):
    bus = open_bus(BusSettings(interface="virtual", channel=channel))
    assert isinstance(bus, InProcessBus)
    bus.shutdown()


def test_the_clock_of_a_channel_lasts_until_its_last_member_has_left(channel):
    first, second = InProcessBus(channel), InProcessBus(channel)
    first.use_clock(lambda: 7)
    first.shutdown()
    third = InProcessBus(channel)
    third.send_frame(0x80, b"")
    assert [stamp for stamp, *_ in second.take()] == [7]
    for bus in (second, third):
        bus.shutdown()
    fourth, fifth = InProcessBus(channel), InProcessBus(channel)
    fourth.send_frame(0x80, b"")
    assert [stamp for stamp, *_ in fifth.take()] != [7]
    for bus in (fourth, fifth):
        bus.shutdown()
