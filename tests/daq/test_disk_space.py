"""Disks that are small, fill up, or take no more of a file: nothing starts, or the motion stops and what was measured is kept."""

import os
import re
import resource
import subprocess
import threading
import time

import pytest

from daq.disk_space import needed_megabytes
from daq.recovery import recording_state
from daq.session_events import SessionState
from daq.session_workflow import PayloadSession
from identify.recording import InputError
from tests.daq.ended_session import assert_at_rest_and_kept
from tests.daq.rig_variants import with_storage


def test_a_disk_that_has_less_room_than_the_session_needs_starts_nothing(rig, short_plan, tmp_path):
    greedy = with_storage(rig, disk_reserve=1e12)
    folder = tmp_path / "experiment"
    with PayloadSession(greedy, folder, short_plan, rig.payload("none"), "operator") as session:
        with pytest.raises(
            InputError, match=r"MB free; a session of \d+ s needs \d+ MB, and 1e\+12 MB must stay"
        ):
            session.check()
        assert session.state is SessionState.NEW
    assert list(folder.glob("**/session-*")) == []


def test_what_a_session_is_said_to_need_is_what_it_takes(rig, armed_session, short_plan):
    session = armed_session(rig)
    session.start()
    assert session.wait(60) is SessionState.DONE
    taken = sum(path.stat().st_size for path in session.experiment.glob("session-*")) / 1e6
    assert taken < needed_megabytes(rig, short_plan.duration) < 20 * taken


def test_a_disk_that_falls_below_its_reserve_during_the_motion(rig, small_disk, armed_session, long_plan):
    reserve = small_disk.free() / 1e6 - needed_megabytes(rig, long_plan.duration) - 1.0
    kept_free = with_storage(rig, disk_reserve=reserve)
    session = armed_session(kept_free, plan=long_plan, folder=small_disk.folder / "e")
    session.start()
    small_disk.when_recorded(session)
    small_disk.fill(leave=reserve * 1e6 - 1e6)
    assert session.wait(60) is SessionState.FAULTED
    assert re.search(r"the disk has \d+ MB left, less than the \d+", session.reason)
    assert_at_rest_and_kept(session, "full disk")


def test_a_disk_that_is_full_during_the_motion(rig, small_disk, armed_session, long_plan):
    to_the_last = with_storage(rig, disk_reserve=0.0)
    session = armed_session(to_the_last, plan=long_plan, folder=small_disk.folder / "e")
    session.start()
    small_disk.when_recorded(session)
    small_disk.fill(leave=0)
    assert session.wait(60) is SessionState.FAULTED
    assert "disk" in session.reason
    rows = recording_state(session.file).rows
    assert rows > 500
    assert small_disk.folder.joinpath("e", "incomplete", "session-00.h5").stat().st_size > 0


def test_a_disk_that_takes_no_more_of_the_file(rig, armed_session, long_plan):
    """By the file size that the recorder is allowed: any user's machine has that, and it is an error of the same kind."""
    session = armed_session(rig, plan=long_plan)
    session.start()
    pause, end = threading.Event(), time.monotonic() + 60
    while recording_state(session.file).rows < 2000:
        assert time.monotonic() < end
        pause.wait(0.01)
    size = session.file.stat().st_size
    resource.prlimit(session.processes.recorder.pid, resource.RLIMIT_FSIZE, (size + 4096, size + 4096))
    assert session.wait(60) is SessionState.FAULTED
    assert "disk" in session.reason
    state = recording_state(session.file)
    assert state.status == "faulted"
    assert state.rows >= 2000


class SmallDisk:
    """A file system of a few dozen megabytes, in memory."""

    def __init__(self, folder) -> None:
        self.folder = folder
        self._ballast = folder / "ballast"

    def free(self) -> float:
        """Bytes."""
        state = os.statvfs(self.folder)
        return state.f_bavail * state.f_frsize

    def fill(self, leave: float) -> None:
        """Take all but so many bytes."""
        with self._ballast.open("wb", buffering=0) as file:
            try:
                while self.free() > leave:
                    file.write(bytes(int(min(1 << 16, max(4096, self.free() - leave)))))
            except OSError:
                return  # full, as asked

    def when_recorded(self, session) -> None:
        """Wait until some seconds of motion are on it."""
        pause, end = threading.Event(), time.monotonic() + 60
        while recording_state(session.file).rows < 2000:
            assert time.monotonic() < end
            assert not session.state.ended, session.reason
            pause.wait(0.01)


@pytest.fixture
def small_disk(tmp_path):
    folder = tmp_path / "disk"
    folder.mkdir()
    made = subprocess.run(
        ["mount", "-t", "tmpfs", "-o", "size=200m", "none", str(folder)], capture_output=True, text=True
    )
    if made.returncode:
        pytest.skip(f"a small file system cannot be mounted here: {made.stderr.strip()}")
    yield SmallDisk(folder)
    subprocess.run(["umount", "-l", str(folder)], check=True)
