"""Many at once in one experiment's folder: nobody touches a file that they did not make, and every step happens once."""

import threading

import h5py
import numpy as np
import pytest

from daq.experiment_folder import claim_recording, open_experiment
from daq.raw_log import raw_log_of
from daq.recovery import being_written, recover_recording
from daq.session_events import SessionState, StepOutOfTurn
from daq.session_workflow import PayloadSession
from identify.recording import InputError, load_experiment


def at_once(count: int, call) -> list[object]:
    """What each of `count` calls that begin together gave or raised."""
    barrier, results = threading.Barrier(count), []

    def one(number: int) -> None:
        barrier.wait()
        try:
            results.append(call(number))
        except Exception as error:
            results.append(error)

    threads = [threading.Thread(target=one, args=(number,)) for number in range(count)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    return results


def test_a_number_is_claimed_by_one_only(rig, tmp_path):
    open_experiment(tmp_path / "e", rig)
    claimed = at_once(8, lambda number: claim_recording(tmp_path / "e").name)
    assert sorted(claimed) == [f"session-{number:02d}.h5" for number in range(8)]


def test_two_sessions_armed_at_once_in_one_folder_both_keep_every_row(rig, short_plan, tmp_path):
    folder = tmp_path / "experiment"
    sessions = [
        PayloadSession(rig, folder, short_plan, rig.payload(name), "operator") for name in ("none", "disk-7")
    ]
    try:
        for session in sessions:
            assert session.check().ok
            session.confirm_payload(session.payload.mass)
        assert at_once(2, lambda number: sessions[number].arm()) == [None, None]
        for session in sessions:
            session.start()
        assert [session.wait(120) for session in sessions] == [SessionState.DONE] * 2
    finally:
        for session in sessions:
            session.close()
    assert {entry.file for entry in load_experiment(folder).sessions} == {"session-00.h5", "session-01.h5"}
    for session in sessions:
        with h5py.File(session.file) as file:
            assert file.attrs["status"] == "complete"
            assert f'"{session.payload.name}"' in file.attrs["payload"]
            assert (np.diff(file["cycle"][:]) == 1).all()
            assert len(file["cycle"]) == session.progress.cycles


def test_a_step_that_is_asked_for_many_times_at_once_happens_once(rig, short_plan, tmp_path):
    with PayloadSession(rig, tmp_path / "e", short_plan, rig.payload("none"), "operator") as session:
        checks = at_once(6, lambda number: session.check())
        assert sum(not isinstance(check, Exception) for check in checks) == 1
        assert all(isinstance(check, StepOutOfTurn) for check in checks if isinstance(check, Exception))
        session.confirm_payload(0.0)
        armed = at_once(2, lambda number: session.arm())
        assert sum(result is None for result in armed) == 1
        assert session.state is SessionState.ARMED
        session.start()
        assert session.wait(120) is SessionState.DONE, session.reason


def test_a_recording_that_grows_is_recovered_by_nobody(rig, armed_session):
    session = armed_session(rig)
    assert being_written(session.file)
    with pytest.raises(InputError, match="is being recorded"):
        recover_recording(session.file, "faulted", "somebody else")
    # Not even when its raw log, by whose lock that is told, was deleted.
    raw_log_of(session.file).unlink()
    assert being_written(session.file)


def test_a_recorder_that_is_dead_when_the_session_is_armed_ends_it_in_words(rig, short_plan, tmp_path):
    with PayloadSession(rig, tmp_path / "e", short_plan, rig.payload("none"), "operator") as session:
        assert session.check().ok
        session.confirm_payload(0.0)
        session.processes.recorder.kill()
        session.processes.recorder.wait()
        with pytest.raises(StepOutOfTurn, match="recorder process died"):
            session.arm()
        assert session.wait(30) is SessionState.FAULTED
        assert "the recorder process died before the session was armed" in session.reason
