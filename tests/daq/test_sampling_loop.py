"""The loop from the bus into the rings, with simulated drives in another process."""

import struct
from collections.abc import Iterator

import numpy as np
import pytest

from daq.rig import Rig
from daq.ring_buffer import RingWriter
from daq.samples import sample_dtype
from daq.sampling_loop import SamplingLoop
from drivers.frames import FRAME, OWN, block_of
from drivers.process_data import DriveStream, MappedEntry, ProcessData
from drivers.sync_producer import SYNC_ID

ANSWER = 0x183
STREAM = DriveStream(
    3,
    (
        ProcessData(
            ANSWER,
            1,
            (
                MappedEntry("position", 0x6064, 0, "<i4", 0),
                MappedEntry("command", 0x6074, 0, "<i2", 4),
                MappedEntry("statusword", 0x6041, 0, "<u2", 6),
            ),
        ),
    ),
    ProcessData(
        0x203,
        1,
        (
            MappedEntry("controlword", 0x6040, 0, "<u2", 0),
            MappedEntry("target_position", 0x607A, 0, "<i4", 2),
        ),
    ),
)


class ScriptedDrive:
    """A receiver behind which a drive answers SYNC k when it has been waited for `patience(k)` times."""

    dropped = 0
    clock_source = "none"

    def __init__(self, patience) -> None:
        self.patience = patience
        self.syncs = self.waits = 0
        self._owed: int | None = None
        self._frames: list[tuple[int, int, bytes, int]] = []

    def send(self, can_id: int, data: bytes) -> None:
        if can_id == SYNC_ID:
            self._frames.append((self.syncs * 1_000_000, SYNC_ID, b"", OWN))
            self._owed = self.patience(self.syncs)
            self.syncs += 1
            self._answer_when_due()

    def _answer_when_due(self) -> None:
        if self._owed == 0:
            stamp = self.syncs * 1_000_000 - 500_000
            self._frames.append((stamp, ANSWER, struct.pack("<ihH", self.syncs, 0, 0x1237), 0))
            self._owed = None

    def wait(self, timeout: float) -> None:
        self.waits += 1
        if self._owed is not None:
            self._owed -= 1
            self._answer_when_due()

    def read(self) -> np.ndarray:
        frames, self._frames = self._frames, []
        return block_of(frames, FRAME)


@pytest.fixture
def loop_with(rig: Rig) -> Iterator:
    """Makes loops around a scripted drive: loop_with(drive)."""
    with RingWriter(sample_dtype(1), 1 << 10) as rows, RingWriter(FRAME, 1 << 10) as frames:
        rows.unlink()
        frames.unlink()
        yield lambda drive: SamplingLoop(rig, [STREAM], drive, rows, frames, lambda can_id: 0)


def missed(loop: SamplingLoop) -> int:
    return loop.counters()["sync"]["missed_deadlines"]


def test_an_answer_that_came_while_the_turn_drained_the_bus_is_not_waited_for_again(loop_with):
    drive = ScriptedDrive(patience=lambda cycle: 0)
    loop = loop_with(drive)
    rows = np.concatenate([loop.turn()[0] for _ in range(4)])
    assert missed(loop) == 0
    assert drive.waits == 0
    assert (rows["position"][:, 0] == np.arange(1, len(rows) + 1)).all()


def test_the_next_sync_waits_for_the_answer_to_the_last(loop_with):
    drive = ScriptedDrive(patience=lambda cycle: cycle % 3)
    loop = loop_with(drive)
    rows = np.concatenate([loop.turn()[0] for _ in range(4)])
    assert missed(loop) == 0
    assert (rows["valid"] == 3).all()
    assert (rows["cycle"] == np.arange(len(rows))).all()


def test_a_drive_that_does_not_answer_holds_sync_up_only_for_the_time_out(loop_with):
    silent = {5, 6, 7, 15, 16}
    drive = ScriptedDrive(patience=lambda cycle: 10**9 if cycle in silent else 0)
    loop = loop_with(drive)
    loop._producer.pacing.timeout = 0.001
    rows = np.concatenate([loop.turn()[0] for _ in range(4)])
    assert missed(loop) == len(silent)
    assert set(np.flatnonzero(rows["valid"][:, 0] == 0)) == silent
