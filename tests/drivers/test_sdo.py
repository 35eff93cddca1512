"""SDO with a node whose answers come late, twice, or for something else."""

import struct

import numpy as np
import pytest

from drivers.bus import BusSettings
from drivers.canopen_network import CanopenNetwork
from drivers.errors import DriveError
from drivers.sdo import SdoAccess, _answers
from drivers.virtual_bus import InProcessBus

NODE = 5
OBJECTS = {(0x6064, 0): 1234, (0x6041, 0): 0x0237, (0x6502, 0): 0x3E0}


def answer(request, value):
    """Expedited upload of four bytes."""
    return bytes([0x43]) + request[1:4] + struct.pack("<I", value)


@pytest.fixture
def slow_node(request):
    """An access to a node that holds back its answers to the first requests and then gives them all at once."""
    channel = f"sdo-{request.node.name}"
    settings = BusSettings(interface="virtual", channel=channel)
    bus = InProcessBus(channel)
    held = []

    def make(withheld: int, **arguments):
        def handle(can_id, data):
            if can_id != 0x600 + NODE or data[0] != 0x40:
                return
            index, subindex = struct.unpack_from("<HB", data, 1)
            held.append(answer(data, OBJECTS[index, subindex]))
            if len(held) > withheld:
                for one in held:
                    bus.send_frame(0x580 + NODE, one)

        bus.serve(handle)
        remote = network.add_node(NODE)
        return SdoAccess(NODE, remote, **arguments)

    with CanopenNetwork(settings) as network:
        yield make
    bus.shutdown()


def test_answers_asked_for_twice_are_not_read_as_those_to_the_next_question(slow_node):
    sdo = slow_node(withheld=2, timeout=0.05, retries=2)
    assert sdo.read(0x6064, 0, "uint32") == 1234
    # From here on the node repeats every answer it ever gave before the one that is asked for.
    assert sdo.read(0x6041, 0, "uint32") == 0x0237
    assert sdo.read(0x6502, 0, "uint32") == 0x3E0


def test_a_node_that_answers_only_for_other_objects_has_not_answered(slow_node):
    sdo = slow_node(withheld=1, timeout=0.02, retries=0)
    with pytest.raises(DriveError, match=r"no answer within 0\.02 s, asked 1 times"):
        sdo.read(0x6064, 0, "uint32")


@pytest.mark.parametrize(
    ("asked", "answered"),
    [
        (0x23, 0x60),
        (0x21, 0x60),
        (0x40, 0x43),
        (0x40, 0x41),
        (0x00, 0x20),
        (0x10, 0x30),
        (0x60, 0x00),
        (0x70, 0x11),
    ],
)
def test_an_answer_has_the_server_s_command_specifier_of_cia_301(asked, answered):
    """7.2.4.3: initiate download 1 → 3, initiate upload 2 → 2, download segment 0 → 1, upload segment 3 → 0."""
    multiplexer = b"\x64\x60\x00"
    request = bytes([asked]) + multiplexer + bytes(4)
    assert _answers(request, bytes([answered]) + multiplexer + bytes(4))
    others = {0x00, 0x20, 0x40, 0x60} - {answered & 0xE0}
    assert not any(_answers(request, bytes([other]) + multiplexer + bytes(4)) for other in others)
    assert _answers(request, b"\x80" + multiplexer + bytes(4))  # abort
    assert not _answers(request, bytes([answered]) + multiplexer)  # too short


@pytest.fixture
def node_that_answers(request):
    """An access to a node whose answer to each request is what a function makes of it."""
    channel = f"sdo-{request.node.name}"
    bus = InProcessBus(channel)

    def make(answered, timeout):
        def handle(can_id, data):
            if can_id == 0x600 + NODE and data[0] != 0x80:
                bus.send_frame(0x580 + NODE, answered(bytes(data)))

        bus.serve(handle)
        return SdoAccess(NODE, network.add_node(NODE), timeout=timeout, retries=0)

    with CanopenNetwork(BusSettings(interface="virtual", channel=channel)) as network:
        yield make
    bus.shutdown()


def test_whatever_a_node_answers_is_a_value_or_an_error_in_words(node_that_answers):
    """Random bytes, and random bytes that are told from a right answer by little."""
    random = np.random.default_rng(7)

    def answered(request):
        made = bytearray(random.bytes(random.integers(0, 9) if random.random() < 0.1 else 8))
        if len(made) == 8 and random.random() < 0.8:
            right = {0x40: 0x40, 0x20: 0x60, 0x60: 0x00, 0x00: 0x20}[request[0] & 0xE0]
            made[0] = right | (made[0] & 0x1F)
            if request[0] & 0xE0 in (0x20, 0x40):
                made[1:4] = request[1:4]
        return bytes(made)

    sdo, reasons = node_that_answers(answered, 0.01), []
    for number in range(100):
        try:
            if number % 3:
                sdo.read(0x6064, 0, "int32")
            else:
                sdo.write(0x6064, 0, "int32", number)
        except DriveError as error:
            reasons.append(str(error))
    assert 10 < len(reasons) <= 100
    assert all("node 5" in reason and reason.isprintable() for reason in reasons)


def test_an_answer_that_never_ends_is_broken_off(node_that_answers, monkeypatch):
    """The library reads on, segment by segment, as long as the node sends some."""
    monkeypatch.setattr("drivers.sdo.MOST_SEGMENTS", 20)
    asked = []

    def answered(request):
        asked.append(request)
        return (
            bytes([0x40]) + request[1:4] + bytes(4)
            if request[0] == 0x40
            else bytes([request[0] & 0x10]) + bytes(7)
        )

    with pytest.raises(DriveError, match="does not end after 20 segments"):
        node_that_answers(answered, 20.0).read(0x1008, 0, "uint32")
    assert len(asked) == 21
