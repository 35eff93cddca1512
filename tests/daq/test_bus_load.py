"""How full a bus gets is said before anything is sent, by lengths that a CAN controller would count."""

import can
from hypothesis import given
from hypothesis import strategies as st

from daq import rig_check
from daq.bus_load import BusLoad, OtherTraffic, bit_rate, bus_load, frame_bits
from daq.rig import Rig
from daq.rig_drives import RigDrives
from daq.simulated_rig import simulated_rig
from drivers.bus import BusSettings
from drivers.cia402 import Mode
from drivers.standard_stream import standard_stream


def stuffed(bits):
    """A sequence of bits after ISO 11898-1's rule: after five equal ones the opposite one is put in."""
    out, run, last = [], 0, None
    for bit in bits:
        run = run + 1 if bit == last else 1
        last = bit
        out.append(bit)
        if run == 5:
            last, run = 1 - bit, 1
            out.append(last)
    return out


def crc15(bits):
    value = 0
    for bit in bits:
        value = (value << 1) ^ (0x4599 if (bit ^ value >> 14) & 1 else 0)
        value &= 0x7FFF
    return [value >> place & 1 for place in range(14, -1, -1)]


@given(st.integers(0, 0x7FF), st.binary(max_size=8))
def test_every_frame_written_out_bit_by_bit_lies_between_least_and_most(identifier, data):
    """Start, identifier, RTR, IDE, r0, DLC, data and CRC are stuffed; 10 more bits and 3 between frames are not."""
    body = [0, *(identifier >> place & 1 for place in range(10, -1, -1)), 0, 0, 0]
    body += [len(data) >> place & 1 for place in range(3, -1, -1)]
    body += [byte >> place & 1 for byte in data for place in range(7, -1, -1)]
    length = len(stuffed(body + crc15(body))) + 10 + 3
    least, most = frame_bits(len(data))
    assert least <= length <= most


def test_the_longest_frame_is_that_of_the_textbook():
    assert frame_bits(8) == (111, 135)


def test_six_drives_at_one_kilohertz_do_not_fit_and_what_would_is_said():
    rig = Rig.load("rx130l-joint3-simulated").model_copy(update={"cycle": 0.001})
    mode = Mode.CYCLIC_SYNCHRONOUS_POSITION
    one = [standard_stream(3, rig.profiles[0], mode)]
    assert bus_load(rig, one, 1_000_000).ok
    six = [standard_stream(node, rig.profiles[0], mode) for node in range(1, 7)]
    load = bus_load(rig, six, 1_000_000)
    assert not load.ok
    assert "of the bus at 1000 kbit/s and a cycle of 0.001 s: more than it carries" in load.words
    wanted = rig.model_copy(update={"cycle": load.most / 0.9 * 1.001})
    assert bus_load(wanted, six, 1_000_000).ok
    assert not bus_load(rig, one, 125_000).ok


def test_frames_with_29_bits_take_20_more():
    assert frame_bits(8, extended=True) == (131, 160)


def heard(can_id, count, length=8, extended=False):
    return [can.Message(arbitration_id=can_id, data=bytes(length), is_extended_id=extended)] * count


def test_what_other_nodes_take_is_counted_named_and_added(rig):
    """A sensor at 4 kHz beside a drive at 1 kHz on 1 Mbit/s: 54 % and 35 %."""
    quick = rig.model_copy(update={"cycle": 0.001})
    streams = [standard_stream(3, rig.profiles[0], Mode.CYCLIC_SYNCHRONOUS_POSITION)]
    messages = [*heard(0x1A2, 400), *heard(0x703, 9, 1), *heard(0x183, 100)]
    some = bus_load(quick, streams, 1_000_000, OtherTraffic.of(messages, 0.1, [3]))
    assert some.ok
    assert some.words.endswith("; other nodes' frames (0x1A2) take 54 %")
    flood = OtherTraffic.of([*messages, *heard(0x1F000001, 150, extended=True)], 0.1, [3])
    full = bus_load(quick, streams, 1_000_000, flood)
    assert not full.ok
    assert "(0x1A2, 0x1F000001) take 78 %: together more than it carries" in full.words


def test_a_bus_that_others_fill_is_named_by_the_check_before_anything_is_sent(rig, monkeypatch):
    monkeypatch.setattr(rig_check, "bit_rate", lambda _bus: 500_000)
    monkeypatch.setattr(rig_check, "listen", lambda _rig: (heard(0x1A2, 300), 0.1))
    with simulated_rig(rig, rig.payload("none")):
        drives = RigDrives(rig)
        try:
            check = rig_check.check_rig(drives)
        finally:
            drives.close()
    assert not check.ok
    assert "other nodes' frames (0x1A2) take 81 %: together more than it carries" in check.problems


def test_buses_without_a_bit_rate_have_no_load():
    assert bit_rate(BusSettings(interface="virtual")) is None
    assert bit_rate(BusSettings(interface="udp_multicast", channel="239.0.0.1")) is None
    assert bit_rate(BusSettings(interface="socketcan", channel="can77")) is None
    assert bit_rate(BusSettings(interface="slcan", channel="/dev/ttyACM0", bitrate=500_000)) == 500_000


def test_a_load_says_both_its_bounds():
    assert BusLoad(0.0002, 0.00025, 0.001, 500_000).words == (
        "process data take 20 to 25 % of the bus at 500 kbit/s and a cycle of 0.001 s"
    )
