"""Positions of one cycle, told from those of the one before by SYNC on the bus."""

from __future__ import annotations

import time

import numpy as np
import pytest

from daq.position_input import AFTER_SILENCE, PositionInput
from drivers.frames import FRAME
from drivers.process_data import DriveStream, MappedEntry, ProcessData, lay_out


class Bus:
    """Hands out frames: those that are there, and those that come while it is waited for."""

    dropped = 0
    clock_source = "none"

    def __init__(self) -> None:
        self.there: list[tuple[int, bytes]] = []
        self.coming: list[tuple[int, bytes]] = []

    def read(self):
        block = np.zeros(len(self.there), FRAME)
        for row, (identifier, data) in enumerate(self.there):
            block["can_id"][row] = identifier
            block["data"][row, : len(data)] = np.frombuffer(data, np.uint8)
        self.there = []
        return block

    def wait(self, timeout: float) -> None:
        self.there, self.coming = self.coming, []

    def close(self) -> None:
        self.there = []


def stream_of(node: int) -> DriveStream:
    entries = lay_out([MappedEntry("command", 0x6074, 0, "<i2"), MappedEntry("position", 0x6064, 0, "<i4")])
    return DriveStream(node, (ProcessData(0x180 + node, 1, entries),), ProcessData(0x200 + node, 1, ()))


def tpdo(node: int, position: int) -> tuple[int, bytes]:
    return 0x180 + node, b"\x07\x00" + position.to_bytes(4, "little", signed=True)


SYNC = (0x80, b"")


@pytest.fixture
def bus():
    return Bus()


@pytest.fixture
def positions(bus):
    return PositionInput(bus, [stream_of(1), stream_of(2)], patience=1e-3)


def test_all_axes_of_a_cycle_are_waited_for(bus, positions):
    bus.there, bus.coming = [SYNC, tpdo(2, -70000)], [(0x701, b"\x05"), tpdo(1, 3)]
    assert positions.take() == [3, -70000]


def test_what_came_before_sync_is_of_another_cycle(bus, positions):
    bus.there = [tpdo(1, 1), tpdo(2, 2), SYNC, tpdo(1, 5)]
    assert positions.take() is None
    bus.there = [tpdo(2, 2), SYNC, tpdo(2, 8), tpdo(1, 7)]
    assert positions.take() == [7, 8]


def test_without_a_new_sync_there_are_no_new_positions(bus, positions):
    bus.there = [SYNC, tpdo(1, 1), tpdo(2, 2)]
    assert positions.take() == [1, 2]
    bus.there = [tpdo(1, 1), tpdo(2, 2)]
    assert positions.take() is None


def test_a_drive_that_is_silent_is_not_waited_for_in_full_again_until_it_answers(bus):
    """Behind simulated drives time waits for seconds: in every cycle that would hold up a stop for minutes."""
    patient = PositionInput(bus, [stream_of(1)], patience=0.2)
    waited = []
    bus.wait = lambda timeout: (waited.append(timeout), time.sleep(timeout))
    for come in ([], [], [SYNC, tpdo(1, 4)], []):
        bus.there = come
        waited.append("take")
        patient.take()
    longest = [max(map(float, each), default=0.0) for each in _between(waited)]
    assert longest[0] == pytest.approx(0.2, rel=0.1)
    assert longest[1] <= AFTER_SILENCE
    assert longest[2] == 0.0
    assert longest[3] == pytest.approx(0.2, rel=0.1)


def _between(waited):
    groups = []
    for each in waited:
        if each == "take":
            groups.append([])
        else:
            groups[-1].append(each)
    return groups
