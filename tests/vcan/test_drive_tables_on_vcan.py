"""The drives' own tables over the kernel's CAN: computed, written, read back, and what was there before written back.

What the drive holds is asked for by SDO uploads that are put together here, after CiA 301, on a socket of the test's own.
"""

import struct
import time
from pathlib import Path

import can
import pytest
import yaml

from api.commands.drive_tables import drive_tables as command
from daq.rig import Rig
from identify.results.drive_tables import DriveTablesDocument, JointTables
from tests.api.driven_arm import write_driven_arm
from tests.vcan.conftest import CHANNEL

NODE = 5
ROWS = {0x2020: 8, 0x2021: 8, 0x2022: 8, 0x2024: 32}
"""arrays of the simulated drive's tables and their lengths, from drivers/simulated/simulated.eds; 0x2023 is one value"""
WHEN_SWITCHED_ON = {
    "speeds": [100.0, 400.0, 900.0],  # rpm
    "forward": [0.11, 0.12, 0.13],  # A
    "backward": [-0.21, -0.22, -0.23],
    "constant": 0.05,
    "cogging": [0.01, 0.0, -0.01],
}


@pytest.fixture
def rig_file(tmp_path) -> Path:
    """RX130L joint 3 on vcan0 whose drive has tables already. Node 3 is another drive's, which is on the bus through all of
    these tests."""
    settings = Rig.load("rx130l-joint3-simulated").model_dump(mode="json", exclude_none=True)
    settings |= {"name": "tables-on-vcan", "bus": {"interface": "socketcan", "channel": CHANNEL}}
    settings["axes"][0] |= {"node": NODE, "drive": "simulated"}
    settings["simulated"]["drives"][0]["compensation"] = WHEN_SWITCHED_ON
    path = tmp_path / "rig.yaml"
    path.write_text(yaml.safe_dump(settings), encoding="utf-8")
    return path


def uploaded(bus: can.BusABC, index: int, subindex: int) -> int:
    """A signed value of at most four bytes that the drive holds, by an expedited upload."""
    asked = struct.pack("<BHB4x", 0x40, index, subindex)
    bus.send(can.Message(arbitration_id=0x600 + NODE, data=asked, is_extended_id=False))
    latest = time.monotonic() + 30.0
    while (left := latest - time.monotonic()) > 0.0:
        answer = bus.recv(left)
        if answer is None or answer.arbitration_id != 0x580 + NODE:
            continue
        specifier, *where = struct.unpack_from("<BHB", answer.data)
        assert (specifier & 0xF3, where) == (0x43, [index, subindex]), answer
        return int.from_bytes(answer.data[4 : 8 - (specifier >> 2 & 3)], "little", signed=True)
    raise AssertionError(f"no answer for 0x{index:04X}:{subindex:02X}")


def held_by_the_drive() -> dict[str, int]:
    """All objects of the drive's tables, as the command's documents name them."""
    places = [(index, place) for index, length in ROWS.items() for place in range(1, length + 1)]
    with can.Bus(interface="socketcan", channel=CHANNEL) as bus:
        return {
            f"0x{index:04X}:{place:02X}": uploaded(bus, index, place)
            for index, place in [*places, (0x2023, 0)]
        }


def objects(joint: JointTables) -> dict[str, float]:
    return {each.object: each.value for table in joint.tables for each in table.objects}


def test_tables_are_written_over_the_kernel_s_can_and_what_was_there_before_is_written_back(
    rig_file, drive_on_the_bus, tmp_path, capsys
):
    rig, kept = str(rig_file), tmp_path / "before.json"
    write_driven_arm(tmp_path / "arm", Rig.load(rig), ("none",))
    before = held_by_the_drive()
    assert [before[f"0x2022:0{place}"] for place in (1, 2, 3)] == [-210, -220, -230]
    assert (before["0x2020:02"], before["0x2023:00"], before["0x2024:03"]) == (40_000, 50, -10)

    command(rig, str(tmp_path / "arm"), "usual", as_json=True)
    shown = objects(DriveTablesDocument.model_validate_json(capsys.readouterr().out).joints[0])
    assert held_by_the_drive() == before  # shown and not written

    command(rig, str(tmp_path / "arm"), "usual", write=True, keep=kept, yes=True, as_json=True)
    assert DriveTablesDocument.model_validate_json(capsys.readouterr().out).written
    written = held_by_the_drive()
    assert len(shown) == 25  # of friction; the model has no cogging, whose table is left alone
    assert written == before | shown
    assert written != before

    command(rig, back_to=kept, write=True, keep=tmp_path / "between.json", yes=True)
    assert held_by_the_drive() == before

    command(rig, clear=True, write=True, keep=tmp_path / "cleared.json", yes=True)
    cleared = held_by_the_drive()
    assert {name for name, value in cleared.items() if value} == {
        name for name, value in before.items() if value and name.startswith("0x2020")
    }
