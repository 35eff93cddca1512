"""What a drive held before it was set up is put back: by what the (simulated) drive itself holds before and afterwards."""

from __future__ import annotations

import pickle

import pytest

from drivers.as_found import HeldSettings
from drivers.cia402 import Mode
from drivers.errors import DriveError
from drivers.process_data import TARGET_TORQUE, read_pdo
from drivers.simulated.oddities import OdditySettings
from tests.drivers.refused_writes import refuse_writes

CSP = Mode.CYCLIC_SYNCHRONOUS_POSITION
OF_ITS_OWN_MASTER = {
    (0x1016, 1, "uint32"): 0x0001_01F4,
    (0x1017, 0, "uint16"): 700,
    (0x1006, 0, "uint32"): 4000,
    (0x60C2, 1, "uint8"): 4,
    (0x1400, 5, "uint16"): 90,
    (0x6007, 0, "int16"): 1,
    (0x6098, 0, "int8"): 35,
}
"""settings that another controller gave the drive"""
PDOS = [(kind, number) for kind in ("TPDO", "RPDO") for number in (1, 2, 3, 4)]


def held(drive):
    """All settings that a session may write, as the drive says them."""
    values = {address: drive.sdo.read(*address) for address in OF_ITS_OWN_MASTER}
    return values | {pdo: read_pdo(drive.sdo, *pdo) for pdo in PDOS}


@pytest.fixture
def found(open_bench):
    """A drive that its machine's controller has set up, and what it holds; nothing is known of that here."""
    bench = open_bench()
    drive = bench.drive
    for (index, subindex, kind), value in OF_ITS_OWN_MASTER.items():
        drive.sdo.write(index, subindex, kind, value)
    drive.sdo.write(0x1A01, 0, "uint8", 0)
    drive.sdo.write(0x1A01, 1, "uint32", 0x6041_0010)
    drive.sdo.write(0x1A01, 2, "uint32", 0x6061_0008)
    drive.sdo.write(0x1A01, 0, "uint8", 2)
    drive.sdo.write(0x1801, 2, "uint8", 254)
    drive.sdo.write(0x1801, 1, "uint32", 0x4000_0000 | 0x285)
    drive.as_found.held = HeldSettings()
    drive.as_found._asked.clear()
    return drive, held(drive)


def set_up(drive):
    drive.produce_heartbeat(0.1)
    stream = drive.map_stream(CSP, torque=TARGET_TORQUE)
    drive.set_cycle(0.001)
    drive.watch_setpoints(stream, 0.02)
    drive.watch_master(127, 0.5)
    drive.sdo.write(0x6098, 0, "int8", 17)


def test_all_that_a_session_sets_is_as_it_was_once_it_is_put_back(found):
    drive, before = found
    set_up(drive)
    assert all(value != before[address] for address, value in held(drive).items() if len(address) == 3)
    assert drive.as_found.put_back() == []
    assert held(drive) == before
    assert drive.as_found.put_back() == []


@pytest.mark.parametrize("at", range(1, 24, 4))
def test_a_set_up_that_breaks_off_at_any_write_is_put_back_too(found, monkeypatch, at):
    drive, before = found
    whole, written = drive.sdo.write_bytes, []

    def breaking(index, subindex, data, what=""):
        written.append((index, subindex))
        if len(written) == at:
            raise DriveError(drive.node, what, index=index, subindex=subindex, received="no answer")
        whole(index, subindex, data, what)

    monkeypatch.setattr(drive.sdo, "write_bytes", breaking)
    with pytest.raises(DriveError, match="no answer"):
        set_up(drive)
    monkeypatch.undo()
    assert drive.as_found.put_back() == []
    assert held(drive) == before


def test_another_process_puts_back_what_the_first_one_kept(found, open_bench):
    drive, before = found
    set_up(drive)
    kept = pickle.loads(pickle.dumps(drive.as_found.held))
    drive.as_found.held = HeldSettings()
    assert drive.as_found.put_back() == []
    assert held(drive) != before
    drive.as_found.held = kept
    assert drive.as_found.put_back() == []
    assert held(drive) == before


def test_the_watch_over_the_master_alone_is_put_back(found):
    drive, before = found
    set_up(drive)
    drive.end_master_watch()
    assert drive.sdo.read(0x1016, 1, "uint32") == before[0x1016, 1, "uint32"]
    assert drive.sdo.read(0x1017, 0, "uint16") == 100


def test_commands_and_what_is_written_to_stay_are_not_put_back(found):
    drive, _ = found
    drive.set_mode(CSP)
    drive.disable()
    drive.clear_torque_offset()
    with drive.sdo.lasting():
        drive.sdo.write(0x6098, 0, "int8", 17)
    assert drive.as_found.held == HeldSettings()
    drive.as_found.put_back()
    assert drive.sdo.read(0x6098, 0, "int8") == 17


def test_what_a_drive_does_not_take_back_is_named_and_the_rest_is_put_back(found, monkeypatch):
    drive, before = found
    set_up(drive)
    refuse_writes(monkeypatch, drive, 0x1006)
    assert drive.as_found.put_back() == ["0x1006:00"]
    after = held(drive)
    assert {address for address in before if after[address] != before[address]} == {(0x1006, 0, "uint32")}


def test_a_drive_that_is_silent_is_not_asked_for_each_object(found, monkeypatch):
    drive, _ = found
    set_up(drive)
    asked = []

    def silent(index, subindex, what=""):
        asked.append(index)
        raise DriveError(drive.node, what, index=index, received="no answer within 0.1 s")

    monkeypatch.setattr(drive.sdo, "read_bytes", silent)
    with pytest.raises(DriveError, match="no answer"):
        drive.as_found.put_back()
    assert len(asked) == 1


def test_an_object_that_can_only_be_read_is_no_matter(open_bench, axis):
    bench = open_bench(axis(oddities=OdditySettings(read_only=("0x1016",), node_guarding_only=False)))
    bench.drive.watch_master(127, 0.5)
    assert bench.drive.as_found.put_back() == []
