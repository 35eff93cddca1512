"""The ring buffer in shared memory."""

import multiprocessing
import os
import signal
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from daq import ring_buffer
from daq.ring_buffer import RingOverrun, RingReader, RingWriter, remove_abandoned_rings

ROW = np.dtype([("cycle", "<i8"), ("position", "<i4", (3,)), ("valid", "u1")])


def rows(first: int, count: int) -> np.ndarray:
    block = np.zeros(count, ROW)
    block["cycle"] = np.arange(first, first + count)
    block["position"] = block["cycle"][:, None] * [1, -2, 3]
    block["valid"] = block["cycle"] % 251
    return block


def test_a_reader_receives_the_rows_with_their_types():
    with RingWriter(ROW, 16) as writer, RingReader(writer.name) as reader:
        writer.write(rows(0, 5))
        received = reader.read()
        assert received.dtype == ROW
        np.testing.assert_array_equal(received, rows(0, 5))
        assert len(reader.read()) == 0
        writer.unlink()


@settings(deadline=None, max_examples=200)
@given(
    capacity=st.integers(1, 20),
    steps=st.lists(st.one_of(st.integers(0, 45), st.tuples(st.integers(0, 9))), max_size=40),
)
def test_a_reader_sees_every_row_once_or_is_told_how_many_it_lost(capacity, steps):
    """Integers write so many rows, tuples read at most so many; a queue without a limit is the reference."""
    with RingWriter(ROW, capacity) as writer, RingReader(writer.name) as reader:
        writer.unlink()
        written = expected = 0
        for step in steps:
            if isinstance(step, int):
                writer.write(rows(written, step))
                written += step
                continue
            lost = max(0, written - capacity - expected)
            if lost:
                with pytest.raises(RingOverrun) as overrun:
                    reader.read(step[0])
                assert (overrun.value.lost, overrun.value.first) == (lost, expected)
                expected += lost
            received = reader.read(step[0])
            np.testing.assert_array_equal(received, rows(expected, min(step[0], written - expected)))
            expected += len(received)


def test_a_late_reader_begins_at_the_oldest_row_that_is_still_there():
    with RingWriter(ROW, 8) as writer:
        writer.write(rows(0, 21))
        with RingReader(writer.name) as reader:
            np.testing.assert_array_equal(reader.read(), rows(13, 8))
        writer.unlink()


def test_the_latest_rows_can_be_looked_at_without_moving_the_reader():
    with RingWriter(ROW, 8) as writer, RingReader(writer.name) as reader:
        writer.write(rows(0, 11))
        np.testing.assert_array_equal(reader.latest(3), rows(8, 3))
        np.testing.assert_array_equal(reader.latest(100), rows(3, 8))
        writer.write(rows(11, 1))
        assert reader.position == 0
        writer.unlink()


@pytest.mark.parametrize(("meanwhile", "seen"), [(0, (5, 3)), (7, (7, 1)), (8, (13, 3)), (9, (14, 3))])
def test_of_the_latest_rows_those_that_were_overwritten_meanwhile_are_not_given(monkeypatch, meanwhile, seen):
    """Of rows 5 to 7 in a ring of 8, as many as the writer goes beyond row 13 are torn; where all are, the newest are read."""
    with RingWriter(ROW, 8) as writer, RingReader(writer.name) as reader:
        writer.write(rows(0, 8))
        fences = iter(range(100))

        def fence():
            if next(fences) == 1:  # between the reader's copy and its look at what was torn
                writer.write(rows(8, meanwhile))

        monkeypatch.setattr(ring_buffer, "_fence", fence)
        np.testing.assert_array_equal(reader.latest(3), rows(*seen))
        writer.unlink()


def test_the_room_counts_down_until_the_recorder_says_how_far_it_has_come():
    with RingWriter(ROW, 8) as writer, RingReader(writer.name) as reader:
        writer.write(rows(0, 6))
        assert writer.room == 2
        reader.read(4)
        reader.publish_position()
        assert writer.room == 6
        writer.unlink()


def test_the_end_is_told():
    with RingWriter(ROW, 8) as writer, RingReader(writer.name) as reader:
        assert not reader.finished
        writer.finish()
        assert reader.finished
        writer.unlink()


def test_a_ring_that_is_not_there_is_an_error():
    with pytest.raises(FileNotFoundError):
        RingReader("no-such-ring")


def _write_as_fast_as_possible(name: str, block: int, total: int, ready, go) -> None:
    with RingWriter(ROW, 4096, name) as writer:
        ready.set()
        go.wait(60)
        for first in range(0, total, block):
            writer.write(rows(first, block))
        writer.finish()


@pytest.mark.parametrize("block", [1, 100])
def test_no_torn_row_is_accepted_between_processes(block):
    """A writer that never waits, a reader in another process: each row accepted is whole and in order."""
    context = multiprocessing.get_context("spawn")
    ready, go = context.Event(), context.Event()
    name = f"stress-{os.getpid()}-{block}"
    total = 60_000 * block
    process = context.Process(target=_write_as_fast_as_possible, args=(name, block, total, ready, go))
    process.start()
    assert ready.wait(60)
    with RingReader(name) as reader:
        reader.unlink()
        go.set()
        accepted = lost = 0
        gaps = []
        while True:
            finished = reader.finished
            try:
                received = reader.read()
            except RingOverrun as overrun:
                gaps.append((overrun.first, accepted + lost))
                lost += overrun.lost
                continue
            first = accepted + lost
            np.testing.assert_array_equal(received, rows(first, len(received)))
            accepted += len(received)
            if finished and not len(received):
                break
            assert finished or reader.writer_alive
    process.join(30)
    assert accepted + lost == total
    assert all(said == expected for said, expected in gaps)
    assert accepted > 0


def test_a_reader_that_ends_leaves_the_ring_alone():
    """In Python 3.11 the standard library's shared memory unlinks a segment when a mere reader exits."""
    with RingWriter(ROW, 8) as writer:
        writer.write(rows(0, 3))
        script = (
            "import sys; from daq.ring_buffer import RingReader\n"
            "with RingReader(sys.argv[1]) as reader: print(len(reader.read()))"
        )
        root = Path(__file__).parents[2]
        done = subprocess.run(
            [sys.executable, "-c", script, writer.name], capture_output=True, text=True, cwd=root, check=True
        )
        assert (done.stdout.strip(), done.stderr) == ("3", "")
        with RingReader(writer.name) as second:
            np.testing.assert_array_equal(second.read(), rows(0, 3))
        writer.unlink()


def _write_then_wait(name: str, ready) -> None:
    writer = RingWriter(ROW, 8, name)
    writer.write(rows(0, 3))
    ready.set()
    signal.pause()


def test_rows_of_a_killed_writer_can_still_be_read_and_its_death_is_seen():
    context = multiprocessing.get_context("spawn")
    ready = context.Event()
    name = f"killed-{os.getpid()}"
    process = context.Process(target=_write_then_wait, args=(name, ready))
    process.start()
    assert ready.wait(60)
    with RingReader(name) as reader:
        assert reader.writer_alive
        process.kill()
        process.join(30)
        assert not reader.writer_alive
        np.testing.assert_array_equal(reader.read(), rows(0, 3))
        path = reader.path
        os.utime(path, (0, 0))
        remove_abandoned_rings()
        assert path.exists(), "a ring that somebody reads must stay"
    remove_abandoned_rings()
    assert not path.exists()
