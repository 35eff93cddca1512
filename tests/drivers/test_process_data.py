"""How entries lie in a PDO, by CiA 301's own rules."""

import struct

import pytest

from drivers.errors import DriveError
from drivers.process_data import (
    DriveStream,
    MappedEntry,
    PdoParameters,
    ProcessData,
    WantedPdo,
    lay_out,
    set_transmission_type,
)

POSITION = MappedEntry("position", 0x6064, 0, "<i4")
STATUS = MappedEntry("statusword", 0x6041, 0, "<u2")
COMMAND = MappedEntry("command", 0x6074, 0, "<i2")


def test_a_mapping_entry_is_index_subindex_and_length_in_bits():
    assert POSITION.mapping == 0x60640020
    assert MappedEntry("command", 0x30D0, 1, "<i2").mapping == 0x30D00110


def test_entries_follow_each_other_without_gaps():
    assert [entry.byte_offset for entry in lay_out([STATUS, POSITION, COMMAND])] == [0, 2, 6]


def test_more_than_eight_bytes_are_refused_with_their_names():
    with pytest.raises(ValueError, match=r"position, position, command need 10 bytes; a PDO has 8"):
        lay_out([POSITION, POSITION, COMMAND])


def test_a_pdo_packs_its_entries_in_little_endian_order():
    pdo = ProcessData(0x205, 1, lay_out([STATUS, POSITION]))
    assert pdo.length == 6
    assert pdo.packer.pack(0x1234, -2) == bytes.fromhex("3412feffffff") == struct.pack("<Hi", 0x1234, -2)
    assert pdo.entry("position").byte_offset == 2
    with pytest.raises(KeyError, match="target"):
        pdo.entry("target")


def test_a_stream_finds_which_pdo_carries_a_value():
    first, second = (
        ProcessData(0x185, 1, lay_out([STATUS])),
        ProcessData(0x285, 1, lay_out([POSITION, COMMAND])),
    )
    setpoint = ProcessData(0x205, 1, lay_out([STATUS, POSITION]))
    stream = DriveStream(5, (first, second), setpoint)
    assert stream.transmit_ids == (0x185, 0x285)
    pdo, entry = stream.find("command")
    assert (pdo.can_id, entry.byte_offset) == (0x285, 4)
    assert stream.setpoint(15, -7) == struct.pack("<Hi", 15, -7)
    with pytest.raises(KeyError, match="temperature"):
        stream.find("temperature")


@pytest.mark.parametrize(
    ("cob_id", "kind", "mapping", "to_write"),
    [
        (0x183, 1, (0x60640020,), ""),
        (0x40000183, 1, (0x60640020,), ""),  # bit 30, no remote frames, is no id
        (0x80000183, 1, (0x60640020,), "id"),  # bit 31: off
        (0x184, 1, (0x60640020,), "id"),
        (0x183, 255, (0x60640020,), "type"),
        (0x183, 1, (0x60640020, 0x60410010), "mapping"),
        (0x183, 1, (), "mapping"),
    ],
)
def test_what_a_drive_has_otherwise_is_written_and_nothing_else(cob_id, kind, mapping, to_write):
    wanted = WantedPdo("TPDO", 1, 0x183, 1, (POSITION,))
    present = PdoParameters("TPDO", 1, cob_id, kind, mapping)
    assert wanted.readdressed(present) is (to_write == "id")
    assert wanted.retimed(present) is (to_write == "type")
    assert wanted.remapped(present) is (to_write == "mapping")
    assert wanted.differs(present) is bool(to_write)


class _FixedTypes:
    """SDO access to a drive whose transmission types can only be read, or that keeps silent."""

    def __init__(self, answer: str) -> None:
        self.answer = answer

    def write_verified(self, index: int, *_arguments: object) -> None:
        raise DriveError(5, "mapping", index=index, received=self.answer)


@pytest.mark.parametrize(
    ("kind", "present", "usable"),
    [
        *(("RPDO", present, True) for present in (0, 1, 240, 254, 255)),
        *(("RPDO", present, False) for present in (241, 252, 253)),
        ("TPDO", 1, False),
    ],
)
def test_an_rpdo_that_is_taken_at_sync_or_at_once_is_used_as_it_stands(kind, present, usable):
    """CiA 301: 0 to 240 go with SYNC, 254 and 255 with an event, 241 to 253 are reserved or asked for."""
    pdo = PdoParameters(kind, 1, 0x205, present, ())
    if usable:
        assert set_transmission_type(_FixedTypes("the drive refused"), pdo, 1, "mapping") == present
    else:
        with pytest.raises(DriveError):
            set_transmission_type(_FixedTypes("the drive refused"), pdo, 1, "mapping")
    with pytest.raises(DriveError):  # silence is no refusal
        set_transmission_type(_FixedTypes("nothing came"), pdo, 1, "mapping")
