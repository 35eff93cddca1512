"""PDOs of a drive whose mapping cannot be changed: which of them serve, what they lack, and what is written to them."""

from __future__ import annotations

from dataclasses import dataclass, field

import pytest

from drivers.cia402 import Mode
from drivers.errors import DriveError
from drivers.fixed_mapping import OwnPdos, constants, own_receive_pdo, own_transmit_pdos, used_as_they_stand
from drivers.process_data import MappedEntry, PdoParameters, ProcessData, lay_out

POSITION = MappedEntry("position", 0x6064, 0, "<i4")
STATUS = MappedEntry("statusword", 0x6041, 0, "<u2")
COMMAND = MappedEntry("command", 0x6077, 0, "<i2")
WORD = MappedEntry("controlword", 0x6040, 0, "<u2")
TARGET = MappedEntry("target", 0x607A, 0, "<i4")
WANTED = (POSITION, STATUS, COMMAND)
OFF = 1 << 31


def tpdo(number, *mapping, cob_id=None, timing=1):
    return PdoParameters(
        "TPDO", number, 0x80 + 0x100 * number + 5 if cob_id is None else cob_id, timing, mapping
    )


def rpdo(number, *mapping, cob_id=None, timing=1):
    return PdoParameters(
        "RPDO", number, 0x100 + 0x100 * number + 5 if cob_id is None else cob_id, timing, mapping
    )


def laid(entries):
    return [(entry.name, entry.index, entry.subindex, entry.byte_offset, entry.kind) for entry in entries]


@dataclass
class Objects:
    """The objects of a drive, which say what was written to them."""

    values: dict[tuple[int, int], int]
    node: int = 5
    written: list[tuple[int, int, int]] = field(default_factory=list)

    def read(self, index, subindex, kind, what=""):
        return self.values[index, subindex]

    def read_bytes(self, index, subindex, what=""):
        return self.values[index, subindex].to_bytes(8, "little")

    def write_verified(self, index, subindex, kind, value, what=""):
        self.write(index, subindex, kind, value, what)

    def write(self, index, subindex, kind, value, what=""):
        self.written.append((index, subindex, value))
        self.values[index, subindex] = value


def test_the_transmit_pdos_that_carry_something_are_used_with_what_else_is_in_them():
    one = tpdo(1, 0x60410010, 0x60610008)
    two = tpdo(2, 0x60FD0020)
    three = tpdo(3, 0x60640020, 0x20100310, 0x60770010)
    serving = own_transmit_pdos([one, two, three, rpdo(1, 0x60640020)], WANTED)
    assert serving.lacking == ""
    assert [pdo.number for pdo, _ in serving.pdos] == [1, 3]
    assert laid(serving.pdos[0][1]) == [
        ("statusword", 0x6041, 0, 0, "<u2"),
        ("other", 0x6061, 0, 2, "<u1"),
    ]
    assert laid(serving.pdos[1][1]) == [
        ("position", 0x6064, 0, 0, "<i4"),
        ("other", 0x2010, 3, 4, "<u2"),
        ("command", 0x6077, 0, 6, "<i2"),
    ]


def test_what_no_transmit_pdo_carries_is_said_by_its_object():
    whole, off = tpdo(1, 0x60640020, 0x60410010), tpdo(2, 0x60770010, cob_id=0x285 | OFF)
    assert own_transmit_pdos([whole, off], WANTED).lacking == "command (0x6077:00) in a TPDO that is on"
    assert own_transmit_pdos([], WANTED).lacking == "position (0x6064:00) in a TPDO that is on"


@pytest.mark.parametrize(
    ("mapping", "serves"),
    [
        ((0x60640020, 0x60410010, 0x60770010), True),
        ((0x60640020, 0x60410010, 0x60770010, 0x20000001), False),  # a single bit is not read
        ((0x60640020, 0x60410010, 0x60770010, 0x20000008), False),  # nine bytes
    ],
)
def test_a_mapping_that_cannot_be_read_byte_by_byte_does_not_serve(mapping, serves):
    serving = own_transmit_pdos([tpdo(1, *mapping)], WANTED)
    assert (serving.lacking == "") == serves
    assert len(serving.pdos) == serves


def test_one_receive_pdo_takes_all_that_is_wanted_or_none_does():
    apart = [rpdo(1, 0x60400010), rpdo(2, 0x607A0020)]
    together = rpdo(3, 0x60400010, 0x60600008, 0x607A0020)
    serving = own_receive_pdo([*apart, together], [WORD, TARGET])
    ((pdo, entries),) = serving.pdos
    assert (pdo.number, serving.lacking) == (3, "")
    assert [entry.name for entry in entries] == ["controlword", "other", "target"]
    for present in (apart, [rpdo(3, *together.mapping, cob_id=0x405 | OFF)], [tpdo(3, *together.mapping)]):
        refused = own_receive_pdo(present, [WORD, TARGET])
        assert refused == OwnPdos((), "controlword and target (0x607A:00) together in a RPDO that is on")


def test_a_pdo_that_goes_with_sync_already_is_left_alone():
    sdo = Objects({(0x1800, 1): 0x185, (0x1400, 1): 0x205})
    used = used_as_they_stand(sdo, own_transmit_pdos([tpdo(1, *(each.mapping for each in WANTED))], WANTED))
    assert used == (ProcessData(0x185, 1, lay_out(list(WANTED))),)
    receive = own_receive_pdo([rpdo(1, WORD.mapping, TARGET.mapping, timing=240)], [WORD, TARGET])
    assert used_as_they_stand(sdo, receive)[0].transmission_type == 240
    assert sdo.written == []


def test_a_pdo_that_waits_for_events_is_made_synchronous_and_one_that_set_up_switched_off_is_switched_on():
    sdo = Objects({(0x1800, 1): 0x185 | OFF, (0x1800, 2): 254, (0x1800, 0): 2})
    serving = own_transmit_pdos([tpdo(1, *(each.mapping for each in WANTED), timing=254)], WANTED)
    (used,) = used_as_they_stand(sdo, serving)
    assert (used.can_id, used.transmission_type) == (0x185, 1)
    assert (0x1800, 1, 0x185) in sdo.written
    assert sdo.values[0x1800, 2] == 1
    assert not sdo.values[0x1800, 1] & OFF
    # a TPDO of a slower rhythm is no sample of every cycle; 240 serves an RPDO alone
    slow = own_transmit_pdos([tpdo(1, *(each.mapping for each in WANTED), timing=240)], WANTED)
    assert used_as_they_stand(Objects(sdo.values | {(0x1800, 2): 240}), slow)[0].transmission_type == 1


def test_what_is_lacking_is_refused_with_the_node_and_the_remedy():
    lacking = own_transmit_pdos([], WANTED)
    with pytest.raises(
        DriveError, match=r"position \(0x6064:00\) in a TPDO.*map it with the maker's tool"
    ) as refused:
        used_as_they_stand(Objects({}), lacking)
    assert refused.value.node == 5


def test_entries_without_a_use_hold_the_mode_or_what_stands_in_their_object():
    mode, velocity = MappedEntry("other", 0x6060, 0, "<u1"), MappedEntry("other", 0x60FF, 0, "<u2")
    receive = ProcessData(0x205, 1, lay_out([WORD, mode, velocity]))
    sdo = Objects({(0x60FF, 0): 0x11223344})
    assert constants(sdo, receive, Mode.CYCLIC_SYNCHRONOUS_POSITION) == (8, 0x3344)
