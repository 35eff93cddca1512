"""How entries lie in a PDO, by CiA 301's own rules."""

import struct

import pytest

from drivers.process_data import DriveStream, MappedEntry, ProcessData, lay_out

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
