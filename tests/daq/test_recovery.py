"""What becomes of sessions that did not reach their plan's end: listed when they may serve, else with what they lack."""

import json
import os
import shutil
import subprocess
import sys
import threading
import time
from pathlib import Path

import h5py
import numpy as np
import pytest

from daq.excitation.standard_plan import standard_plan
from daq.recovery import recover_experiment
from daq.ring_buffer import RingReader
from daq.samples import Phase
from daq.session_events import SessionState
from identify.identification import identify
from identify.recording import InputError, load_experiment

ROOT = Path(__file__).parents[2]
ENOUGH = 8000
"""cycles of the plan, 16 s"""


@pytest.fixture(scope="module")
def long_plan(rig):
    return standard_plan(rig, 300.0)


def driven(session, cycles: int = ENOUGH) -> None:
    """Start, and wait until so many cycles of the plan have been driven."""
    session.start()
    pause, end = threading.Event(), time.monotonic() + 120
    while session.progress.cycle < cycles and not session.state.ended:
        assert time.monotonic() < end, "it did not happen in time"
        pause.wait(0.005)
    assert not session.state.ended, session.reason


def files(folder: Path) -> list[str]:
    return [entry.file for entry in load_experiment(folder).sessions]


def recover(folder: Path, *more: str) -> subprocess.CompletedProcess[str]:
    return subprocess.run(
        [sys.executable, "-m", "api", "recover", str(folder), *more, "--json"],
        capture_output=True,
        text=True,
        env={**os.environ, "PYTHONPATH": str(ROOT)},
    )


def test_a_session_that_died_with_all_its_processes_is_recovered_listed_and_identified(
    rig, armed_session, long_plan
):
    session = armed_session(rig, "disk-7", plan=long_plan)
    driven(session)
    session.processes.recorder.kill()
    session.processes.acquisition.kill()
    assert session.wait(30) is SessionState.FAULTED
    assert "coulomb recover" in session.reason
    folder = session.experiment
    assert files(folder) == []
    done = recover(folder)
    assert done.returncode == 0, done.stderr
    (told,) = json.loads(done.stdout)["sessions"]
    assert (told["admitted"], told["lacks"]) == (True, "")
    assert "of 300.0 s of the plan were measured; listed" in told["reason"]
    assert files(folder) == ["session-00.h5"]
    experiment = load_experiment(folder)
    assert experiment.sessions[0].payload.name == "disk-7"
    assert (folder / "session-00.log.gz").exists()
    remarks = experiment.read(experiment.sessions[0]).remarks
    assert any("what was measured until then is used" in remark for remark in remarks)
    assert identify(experiment, "usual").document().relative_error < 0.1
    assert recover_experiment(folder, "again") == []


def test_a_session_whose_acquisition_died_is_listed(rig, armed_session, long_plan):
    session = armed_session(rig, plan=long_plan)
    driven(session)
    session.processes.acquisition.kill()
    assert session.wait(30) is SessionState.FAULTED
    (state,) = recover_experiment(session.experiment, "")
    assert state.admitted
    with h5py.File(state.path) as file:
        assert file.attrs["stop_cause"] == "internal error"
        assert file.attrs["status"] == "faulted"


def test_what_an_operator_stopped_is_listed_only_when_a_person_says_so(rig, armed_session, long_plan):
    session = armed_session(rig, plan=long_plan, role="validation")
    driven(session)
    session.stop("it smelled of burnt varnish")
    assert session.wait(30) is SessionState.ABORTED
    folder = session.experiment
    (state,) = recover_experiment(folder, "")
    assert not state.admitted
    assert f"`coulomb recover {folder} --admit session-00.h5`" in state.lacks
    assert files(folder) == []
    with pytest.raises(InputError, match=r"--admit session-07.h5: .* holds no such recording"):
        recover_experiment(folder, "", ["session-07.h5"])
    done = recover(folder, "--admit", "session-00.h5")
    assert json.loads(done.stdout)["sessions"][0]["admitted"]
    assert "it smelled of burnt varnish" in done.stderr
    (entry,) = load_experiment(folder).sessions
    assert (entry.file, entry.role) == ("session-00.h5", "validation")


def test_too_little_motion_is_kept_and_not_listed_whoever_asks(rig, armed_session, long_plan):
    session = armed_session(rig, plan=long_plan)
    driven(session, 100)
    session.stop()
    assert session.wait(30) is SessionState.ABORTED
    with h5py.File(session.file) as file:
        setpoint = file["setpoint"][:, 0]
    if (setpoint[1:] != setpoint[:-1]).sum() * rig.cycle > 10.0:
        pytest.skip("this machine drove more than 10 s before the stop came through")
    (state,) = recover_experiment(session.experiment, "", ["session-00.h5"])
    assert not state.admitted
    assert "s of motion are too little, 10.0 s are needed" in state.lacks
    assert files(session.experiment) == []


def test_rows_that_a_killed_recorder_left_in_the_ring_are_saved(rig, armed_session, long_plan):
    session = armed_session(rig, plan=long_plan)
    with RingReader(f"{session._ring}-rows") as ring:
        driven(session, 4000)
        session.processes.recorder.kill()
        assert session.wait(30) is SessionState.FAULTED
        rows = ring.latest(ring.capacity)
    measured = rows["cycle"][(rows["phase"] == Phase.PLAN) | (rows["phase"] == Phase.STOPPING)]
    with h5py.File(session.file) as file:
        assert file.attrs["status"] == "faulted"
        assert (np.diff(file["cycle"][:]) == 1).all()
        assert file["cycle"][-1] == measured[-1]
    assert session.reason.count("the recorder process died") == 1


def test_a_recording_that_is_deleted_in_motion_is_noticed_and_written_anew(rig, armed_session, long_plan):
    session = armed_session(rig, plan=long_plan)
    driven(session, 2000)
    session.file.unlink()
    assert session.wait(60) is SessionState.FAULTED
    assert "was moved or deleted while it was being recorded" in session.reason
    with h5py.File(session.file) as file:
        assert len(file["cycle"]) >= 2000
        assert file.attrs["stop_cause"] == "recorder"


def test_a_folder_that_is_deleted_in_motion_is_noticed_and_what_was_measured_is_there(
    rig, armed_session, long_plan
):
    session = armed_session(rig, plan=long_plan)
    driven(session, 2000)
    shutil.rmtree(session.experiment)
    assert session.wait(60) is SessionState.FAULTED
    assert "its folder was moved or deleted" in session.reason
    (state,) = recover_experiment(session.experiment, "")
    assert state.rows >= 2000
    assert (session.experiment / "experiment.yaml").exists()


@pytest.mark.parametrize("harm", ["broken", "deleted"])
def test_an_experiment_file_that_is_harmed_in_motion_orphans_no_session(rig, armed_session, short_plan, harm):
    session = armed_session(rig, plan=short_plan)
    session.start()
    yaml = session.experiment / "experiment.yaml"
    text = yaml.read_text(encoding="utf-8")
    yaml.unlink()
    if harm == "broken":
        yaml.write_text("format: [", encoding="utf-8")
    assert session.wait(60) is SessionState.FAULTED
    assert "all of the plan" in session.reason
    assert f"`coulomb recover {session.experiment}` lists them" in session.reason
    if harm == "broken":
        with pytest.raises(InputError, match=r"experiment.yaml"):
            recover_experiment(session.experiment, "")
        yaml.write_text(text, encoding="utf-8")
    (state,) = recover_experiment(session.experiment, "")
    assert state.admitted
    assert files(session.experiment) == ["session-00.h5"]


def test_one_bad_file_keeps_no_other_from_being_recovered(rig, armed_session, long_plan):
    session = armed_session(rig, plan=long_plan)
    driven(session)
    session.processes.acquisition.kill()
    assert session.wait(30) is SessionState.FAULTED
    incomplete = session.experiment / "incomplete"
    (incomplete / "session-05.h5").write_bytes(b"no HDF5 at all")
    with h5py.File(incomplete / "session-06.h5", "w") as odd:
        odd.attrs["payload"] = np.array([1, 2, 3])
        odd.attrs["status"] = np.void(b"\x00\x01")
        odd["cycle"] = np.arange(3)
    states = {state.path.name: state for state in recover_experiment(session.experiment, "")}
    assert states["session-00.h5"].admitted
    for name in ("session-05.h5", "session-06.h5"):
        assert states[name].status == "unreadable"
        assert "move it elsewhere, or delete it" in states[name].lacks
    done = recover(session.experiment)
    assert done.returncode == 0, done.stderr
    assert "session-05.h5: unreadable" in done.stderr
