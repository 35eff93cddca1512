"""What comes from the rings to disk, when, and what is said where it does not."""

import errno
import json
from multiprocessing import Pipe
from pathlib import Path
from types import SimpleNamespace

import h5py
import numpy as np
import pytest

from daq import recorder
from daq.raw_log import raw_log_of, text_of
from daq.recorder import Ending, Recorder, RecorderOrder, record
from daq.recording_file import SessionDescription
from daq.recovery import being_written
from daq.ring_buffer import RingWriter
from daq.safety import StopCause, StopReason
from drivers.frames import FRAME
from tests.daq.recorded_swing import recorded_swing

DONE = Ending(StopReason(StopCause.PLAN_DONE, "the plan was driven to its end"))
CAPACITY = 400


class Bench:
    """Two rings with their writers, a recorder that reads them, what it tells, and its clock."""

    def __init__(self, folder: Path, rig, **order) -> None:
        self.swing = recorded_swing(rig, 3.0)
        self.rows = RingWriter(self.swing.dtype, CAPACITY)
        self.frames = RingWriter(FRAME, CAPACITY)
        description = SessionDescription(rig, {}, rig.payload("none"), "operator", "simulated")
        self.order = RecorderOrder(
            folder / "session-00.h5", description, self.rows.name, self.frames.name, **order
        )
        self.told: list[StopReason] = []
        self.now = 100.0

    def open(self) -> Recorder:
        self.recorder = Recorder(self.order, self.told.append)
        return self.recorder

    def send_frames(self, *identifiers: int) -> None:
        frames = np.zeros(len(identifiers), FRAME)
        frames["can_id"] = identifiers
        self.frames.write(frames)

    def recorded(self) -> tuple[dict, dict[str, np.ndarray]]:
        with h5py.File(self.order.path) as file:
            return dict(file.attrs), {name: file[name][:] for name in ("cycle", "position", "valid")}

    def logged(self) -> list[int]:
        """Identifiers in the raw log."""
        lines = b"".join(text_of(raw_log_of(self.order.path))).decode().splitlines()
        return [int(line.split()[2].split("#")[0], 16) for line in lines]


@pytest.fixture
def bench(tmp_path, rig, monkeypatch):
    """Makes a bench; the recorder's clock is the bench's, and the disk has room."""
    made: list[Bench] = []
    monkeypatch.setattr(recorder, "time", SimpleNamespace(monotonic=lambda: made[-1].now))
    monkeypatch.setattr("daq.recording_file.RecordingFile.free_space", lambda self: 1e12)

    def make(**order) -> Bench:
        made.append(Bench(tmp_path, rig, **order))
        return made[-1]

    yield make
    for each in made:
        for ring in (each.rows, each.frames):
            ring.close()
            ring.unlink()


def test_every_row_and_frame_comes_to_disk_in_its_order_and_is_counted(bench):
    session = bench()
    taking = session.open()
    assert not taking.take()
    for start in (0, 250):
        session.rows.write(session.swing[start : start + 250])
        session.send_frames(0x80, 0x183 + start)
        assert session.rows.room == CAPACITY - 250
        assert taking.take()
        assert session.rows.room == session.frames.room == CAPACITY
    session.send_frames(0x7F)
    assert taking.take()  # frames alone are something too
    session.rows.write(session.swing[500:520])
    taking.finish(Ending(DONE.reason, {"syncs": 7}))
    attributes, columns = session.recorded()
    assert columns["cycle"].tolist() == session.swing["cycle"][:520].tolist()
    assert columns["position"].tolist() == session.swing["position"][:520].tolist()
    assert session.logged() == [0x80, 0x183, 0x80, 0x183 + 250, 0x7F]
    assert (attributes["status"], attributes["stop_cause"]) == ("complete", "plan done")
    assert json.loads(attributes["counters"]) == {
        "syncs": 7,
        "rows": 520,
        "frames": 5,
        "rows_lost_in_ring": 0,
        "frames_lost_in_ring": 0,
        "problems": [],
    }
    assert session.told == []


def test_what_the_ring_lost_is_counted_and_a_whole_recording_is_no_longer_claimed(bench):
    session = bench()
    taking = session.open()
    session.rows.write(session.swing[:450])
    session.send_frames(*range(1, 431))
    session.rows.write(session.swing[450:500])
    taking.finish(DONE)
    attributes, columns = session.recorded()
    assert columns["cycle"].tolist() == session.swing["cycle"][100:500].tolist()
    assert session.logged() == list(range(31, 431))
    counters = json.loads(attributes["counters"])
    assert (counters["rows_lost_in_ring"], counters["frames_lost_in_ring"]) == (100, 30)
    assert (attributes["status"], attributes["stop_cause"]) == ("faulted", "recorder")
    assert attributes["status_reason"].startswith("100 rows were overwritten in the ring")


def test_rows_lost_do_not_hide_why_the_motion_ended(bench):
    session = bench()
    taking = session.open()
    session.rows.write(session.swing[:500])
    taking.finish(Ending(StopReason(StopCause.OPERATOR, "stopped by the operator")))
    attributes, _ = session.recorded()
    assert (attributes["status"], attributes["status_reason"]) == ("aborted", "stopped by the operator")


def test_a_recording_in_doubt_says_so_only_where_the_plan_was_driven_to_its_end(bench, tmp_path):
    for name, reason, status in (
        ("a", DONE.reason, "faulted"),
        ("b", StopReason(StopCause.OPERATOR, "stopped"), "aborted"),
    ):
        (tmp_path / name).mkdir()
        session = bench()
        session.order = RecorderOrder(
            tmp_path / name / "session-00.h5",
            session.order.description,
            session.rows.name,
            session.frames.name,
        )
        taking = session.open()
        session.swing["valid"][::3] |= 0x10  # every third answer came twice
        session.rows.write(session.swing[:300])
        taking.finish(Ending(reason))
        attributes, _ = session.recorded()
        assert attributes["status"] == status
        (problem,) = json.loads(attributes["counters"])["problems"]
        assert "came more than once" in problem
        assert (problem in attributes["status_reason"]) is (status == "faulted")
        if status == "faulted":
            assert attributes["stop_cause"] == "data in doubt"


def test_rows_are_handed_over_each_flush_interval_and_forced_to_disk_each_sync_interval(bench, monkeypatch):
    session = bench()
    taking = session.open()
    storage = session.order.description.rig.storage
    assert (storage.flush_interval, storage.sync_interval) == (0.25, 1.0)
    flushed: list[tuple[float, str, bool]] = []
    monkeypatch.setattr(
        taking.file, "flush", lambda to_disk=False: flushed.append((session.now, "file", to_disk))
    )
    monkeypatch.setattr(
        taking._log, "flush", lambda to_disk=False: flushed.append((session.now, "log", to_disk))
    )
    for eighth in range(1, 17):
        session.now = 100.0 + eighth / 8
        taking.take()
    file = [(now - 100.0, to_disk) for now, which, to_disk in flushed if which == "file"]
    assert file == [(quarter / 4, quarter in (4, 8)) for quarter in range(1, 9)]
    assert [(now - 100.0, to_disk) for now, which, to_disk in flushed if which == "log"] == file
    taking.finish(DONE)


def test_a_disk_below_its_reserve_is_told_once_with_what_is_left(bench, monkeypatch):
    session = bench()
    taking = session.open()
    free = [200.0e6, 199.9e6, 1e6]
    monkeypatch.setattr(taking.file, "free_space", lambda: free.pop(0) if free else 1e12)
    for told in (0, 1, 1):
        session.now += 0.3
        taking.take()
        assert len(session.told) == told
    (reason,) = session.told
    assert reason.cause is StopCause.FULL_DISK
    assert reason.words.startswith("the disk has 200 MB left, less than the 200 MB in reserve")
    taking.finish(Ending(reason))


@pytest.mark.parametrize(
    ("error", "words"),
    [
        (OSError(errno.ENOSPC, "No space left on device"), "the disk is full; "),
        (OSError(errno.EDQUOT, "Quota exceeded"), "the disk is full; "),
        (OSError(errno.EIO, "Input/output error"), "the disk does not take the data (Input/output error); "),
        (OSError("can't write"), "the disk does not take the data (it refuses without a reason); "),
    ],
)
def test_rows_that_the_disk_refuses_wait_for_room_and_frames_are_kept_meanwhile(
    bench, monkeypatch, error, words
):
    session = bench()
    taking = session.open()
    append, refusing = taking.file.append, [True]

    def refuse(rows):
        if refusing:
            raise error
        append(rows)

    monkeypatch.setattr(taking.file, "append", refuse)
    for start in (0, 100):
        session.rows.write(session.swing[start : start + 100])
        session.send_frames(0x100 + start)
        taking.take()
    (reason,) = session.told
    assert reason.cause is StopCause.FULL_DISK
    assert reason.words.startswith(words)
    refusing.clear()
    taking.finish(Ending(reason))
    attributes, columns = session.recorded()
    assert columns["cycle"].tolist() == session.swing["cycle"][:200].tolist()
    assert session.logged() == [0x100, 0x164]
    assert attributes["stop_cause"] == "full disk"


@pytest.mark.parametrize("provisional", [False, True])
def test_a_recording_taken_away_is_told_and_written_anew_unless_nobody_wants_it(bench, provisional):
    session = bench(provisional=provisional)
    taking = session.open()
    session.rows.write(session.swing[:50])
    taking.take()
    session.order.path.unlink()
    session.now += 0.3
    taking.take()
    (reason,) = session.told
    assert reason.cause is StopCause.RECORDER
    assert "session-00.h5 or its folder was moved or deleted" in reason.words
    taking.finish(Ending(reason))
    assert session.order.path.exists() is not provisional
    if not provisional:
        assert len(session.recorded()[1]["cycle"]) == 50


def test_nobody_may_take_a_recording_for_one_left_open_until_it_says_how_it_ended(bench, monkeypatch):
    """Its log is locked that long: whoever recovers recordings meanwhile would write into it too."""
    made = bench()
    kept = made.open()
    finish, seen = kept.file.finish, []

    def watched(*ending):
        seen.append(being_written(made.order.path))
        finish(*ending)
        seen.append(being_written(made.order.path))

    monkeypatch.setattr(kept.file, "finish", watched)
    kept.finish(DONE)
    assert seen == [True, True]
    assert not being_written(made.order.path)
    assert made.recorded()[0]["status"] == "complete"


def test_the_process_records_until_it_is_told_how_the_motion_ended(bench):
    session = bench()
    session.rows.write(session.swing[:30])
    ours, theirs = Pipe()
    with ours, theirs:
        ours.send(DONE)
        record(session.order, theirs)
        assert ours.recv() == "ready"
    attributes, columns = session.recorded()
    assert len(columns["cycle"]) == 30
    assert attributes["status"] == "complete"


def test_the_process_keeps_what_a_dead_acquisition_had_measured(bench):
    session = bench()
    session.rows.write(session.swing[:30])
    ours, theirs = Pipe()
    ours.close()
    with theirs:
        record(session.order, theirs)
    attributes, columns = session.recorded()
    assert len(columns["cycle"]) == 30
    assert (attributes["status"], attributes["stop_cause"]) == ("faulted", "internal error")
    assert "the acquisition process died" in attributes["status_reason"]


def test_the_process_says_where_a_recording_cannot_be_created(bench):
    session = bench()
    session.order.path.touch()
    ours, theirs = Pipe()
    with ours, theirs:
        record(session.order, theirs)
        reason = ours.recv()
        assert not ours.poll()
    assert reason.cause is StopCause.RECORDER
    assert f"the recording {session.order.path} cannot be created" in reason.words
