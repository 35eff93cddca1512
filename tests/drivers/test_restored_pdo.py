"""A PDO written back as it was read, and which object belongs to which PDO (CiA 301, sections 7.5.2.35 to 7.5.2.38)."""

from __future__ import annotations

from dataclasses import replace

import pytest

from drivers.errors import DriveError
from drivers.process_data import read_pdo, switch_off_pdo
from drivers.restored_pdo import pdo_of, restore_pdo


@pytest.mark.parametrize(
    ("index", "subindex", "pdo"),
    [
        (0x1400, 1, ("RPDO", 1)),
        (0x1403, 2, ("RPDO", 4)),
        (0x1400, 5, None),
        (0x1600, 0, ("RPDO", 1)),
        (0x17FF, 3, ("RPDO", 512)),
        (0x1801, 1, ("TPDO", 2)),
        (0x1801, 3, None),
        (0x1A00, 8, ("TPDO", 1)),
        (0x1BFF, 0, ("TPDO", 512)),
        (0x1C00, 0, None),
        (0x1016, 1, None),
        (0x6040, 0, None),
    ],
)
def test_an_object_belongs_to_the_pdo_that_cia_301_says(index, subindex, pdo):
    assert pdo_of(index, subindex) == pdo


@pytest.mark.parametrize(
    "changes",
    [
        {"mapping": (0x6041_0010,)},
        {"mapping": (0x6041_0010, 0x6064_0020), "transmission_type": 1},
        {"transmission_type": 1},
        {"cob_id": 0x4000_0000 | 0x199},
        {"cob_id": 0x8000_0000 | 0x185},
    ],
    ids=["mapping", "mapping and type", "type", "id", "off"],
)
def test_whatever_differs_is_written_back(open_bench, changes):
    sdo = open_bench().drive.sdo
    present = read_pdo(sdo, "TPDO", 1)
    assert present is not None
    wanted = replace(present, **changes)
    restore_pdo(sdo, wanted)
    assert read_pdo(sdo, "TPDO", 1) == wanted
    restore_pdo(sdo, present)
    assert read_pdo(sdo, "TPDO", 1) == present


def test_nothing_is_written_where_nothing_differs(open_bench):
    sdo = open_bench().drive.sdo
    present = read_pdo(sdo, "RPDO", 1)
    sdo.has_written = False
    restore_pdo(sdo, present)
    assert not sdo.has_written


def test_one_that_stays_otherwise_is_named(open_bench, monkeypatch):
    sdo = open_bench().drive.sdo
    present = read_pdo(sdo, "TPDO", 1)
    switch_off_pdo(sdo, "TPDO", 1)
    monkeypatch.setattr(sdo, "write_bytes", lambda *written, **more: None)
    with pytest.raises(DriveError, match=r"putting TPDO 1 back .*0x1800:01.*expected COB-ID"):
        restore_pdo(sdo, present)
