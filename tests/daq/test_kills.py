"""Processes killed and stopped at any moment: the axis comes to rest, and what was measured is there."""

import gzip
import json
import os
import random
import signal
import subprocess
import sys
import threading
import time
from pathlib import Path

import h5py
import numpy as np
import pytest

from daq.excitation.standard_plan import standard_plan
from daq.recovery import being_written, recording_state, recover_experiment
from daq.ring_buffer import RingReader
from daq.samples import Phase
from daq.session_events import SessionState
from tests.daq.session_parent import gone

ROOT = Path(__file__).parents[2]


@pytest.fixture(scope="module")
def long_plan(rig):
    return standard_plan(rig, 300.0)


def wait_until(condition, timeout: float = 60.0) -> None:
    end = time.monotonic() + timeout
    pause = threading.Event()
    while not condition():
        assert time.monotonic() < end, "it did not happen in time"
        pause.wait(0.005)


def last_planned_cycle(reader: RingReader) -> int:
    rows = reader.latest(reader.capacity)
    planned = rows["cycle"][rows["phase"] == Phase.PLAN]
    return int(planned[-1]) if len(planned) else -1


def assert_whole(path: Path, at_least_to_cycle: int) -> None:
    """Without a gap from the plan's begin to at least that cycle."""
    with h5py.File(path) as file:
        cycle = file["cycle"][:]
        assert (np.diff(cycle) == 1).all()
        assert (file["valid"][:] == 3).all()
        assert cycle[-1] >= at_least_to_cycle


@pytest.mark.slow
def test_an_acquisition_process_killed_at_twelve_moments_loses_no_sample(rig, armed_session, long_plan):
    """The recorder goes on: every row that was in the ring comes to disk, and the recording says what happened."""
    moments = random.Random(20)
    for _ in range(12):
        session = armed_session(rig, plan=long_plan)
        with RingReader(f"{session._ring}-rows") as ring:
            session.start()
            after = moments.uniform(0.0, 0.7)
            begun = time.monotonic()
            wait_until(lambda after=after, begun=begun: time.monotonic() - begun >= after)
            session.processes.acquisition.kill()
            assert session.wait(30) is SessionState.FAULTED
            assert "died" in session.reason
            cycle = last_planned_cycle(ring)
        if cycle < 0:
            continue  # killed before the plan began: there is nothing to lose
        state = recording_state(session.file)
        assert state.status == "faulted"
        assert_whole(session.file, cycle)
        session.close()


@pytest.mark.slow
def test_with_recorder_and_acquisition_killed_together_at_most_the_last_flush_interval_is_lost(
    rig, armed_session, long_plan
):
    moments = random.Random(7)
    for _ in range(5):
        session = armed_session(rig, plan=long_plan)
        with RingReader(f"{session._ring}-rows") as ring:
            session.start()
            wait_until(lambda session=session: session.progress.cycle > 0)
            seen: list[tuple[float, int]] = []
            end = time.monotonic() + moments.uniform(0.8, 2.0)
            wait_until(
                lambda end=end, seen=seen, ring=ring: (
                    seen.append((time.monotonic(), last_planned_cycle(ring))) or time.monotonic() >= end
                )
            )
            killed = time.monotonic()
            session.processes.recorder.kill()
            session.processes.acquisition.kill()
            assert session.wait(30) is SessionState.FAULTED
        # What was in the ring one flush interval (and one of the recorder's turns) before the kill is on disk.
        safe = rig.storage.flush_interval + 0.1
        assert_whole(session.file, max(cycle for when, cycle in seen if when <= killed - safe))
        session.close()


def test_a_killed_recorder_ends_the_motion_and_its_file_is_recovered(rig, armed_session, long_plan):
    session = armed_session(rig, plan=long_plan)
    session.start()
    wait_until(lambda: recording_state(session.file).rows > 1000)
    session.processes.recorder.kill()
    assert session.wait(30) is SessionState.FAULTED
    assert session.reason.count("the recorder process died") == 1
    assert recording_state(session.file).status == "faulted"
    assert_whole(session.file, 500)


@pytest.fixture
def parent(tmp_path):
    """A process that holds a running session; killed afterwards if it still runs."""
    process = subprocess.Popen(
        [sys.executable, str(Path(__file__).with_name("session_parent.py")), str(tmp_path / "experiment")],
        stdout=subprocess.PIPE,
        text=True,
        cwd=ROOT,
        env={**os.environ, "PYTHONPATH": str(ROOT)},
    )
    process.children = [int(number) for number in process.stdout.readline().split()]
    assert process.stdout.readline() == "moving\n"
    yield process
    process.kill()
    process.wait()
    process.stdout.close()


@pytest.mark.parametrize(
    "way",
    [signal.SIGKILL, signal.SIGSTOP, signal.SIGUSR1],
    ids=["killed", "hung", "a C call keeps the interpreter's lock"],
)
def test_a_dead_or_hung_parent_lets_the_drive_come_to_rest_with_the_data_on_disk(parent, tmp_path, rig, way):
    parent.send_signal(way)
    wait_until(lambda: all(gone(child) for child in parent.children))
    (path,) = (tmp_path / "experiment" / "incomplete").glob("session-*.h5")
    state = recording_state(path)
    assert state.status == "aborted"
    assert "supervising process" in state.reason
    with h5py.File(path) as file:
        assert (np.diff(file["cycle"][:]) == 1).all()
        at_the_end = file["position"][-20:, 0]
        assert np.ptp(at_the_end) * abs(rig.position_matrix[0, 0]) < 1e-4


def test_recover_closes_what_a_kill_of_everything_left_and_says_so(parent, tmp_path):
    recorder = parent.children[1]
    folder = tmp_path / "experiment"
    (path,) = (folder / "incomplete").glob("session-*.h5")
    log = path.with_name(path.stem + ".log.gz")
    # The drive moves before the recorder's first flush: wait until there is something that a kill can leave.
    wait_until(lambda: log.stat().st_size)
    assert being_written(path)
    assert recover_experiment(folder, "not yet") == []
    for process in (parent.pid, *parent.children):
        os.kill(process, signal.SIGKILL)
    wait_until(lambda: gone(recorder))
    done = subprocess.run(
        [sys.executable, "-m", "api", "recover", str(folder), "--json"],
        capture_output=True,
        text=True,
        cwd=ROOT,
        env={**os.environ, "PYTHONPATH": str(ROOT)},
        check=True,
    )
    (session,) = json.loads(done.stdout)["sessions"]
    assert session["status"] == "faulted"
    assert "recovered" in session["reason"]
    with h5py.File(path) as file:
        assert len(file["cycle"]) == session["samples"]
        assert file.attrs["status"] == "faulted"
    assert gzip.decompress(log.read_bytes()).endswith(b"\n")
