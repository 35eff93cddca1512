"""The payload session, with its real processes and the simulated drive."""

import json
import re
import shutil
import subprocess
import threading
from concurrent.futures import ThreadPoolExecutor

import can
import h5py
import numpy as np
import pytest

from daq.excitation.standard_plan import standard_plan
from daq.experiment_folder import open_experiment
from daq.files_as_read import FilesAsRead
from daq.plan_setpoints import plan_counts
from daq.raw_log import raw_log_of, text_of
from daq.rig import Rig
from daq.session_events import SessionState, StepOutOfTurn
from daq.session_workflow import PayloadSession
from identify.recording import InputError, load_experiment
from tests.daq.rig_variants import with_faults, with_limits


def test_a_session_goes_from_plan_to_a_listed_recording(rig, armed_session, short_plan):
    events, recorded = [], []
    session = armed_session(rig, "disk-7", on_event=events.append, after_session=recorded.append)
    session.start()
    assert session.wait(60) is SessionState.DONE, session.reason
    states = [event.state.value for event in events if event.kind == "state"]
    assert states == ["checked", "payload confirmed", "armed", "running", "done"]
    assert session.file == session.experiment / "session-00.h5"
    assert [r.file for r in recorded] == [session.file]
    experiment = load_experiment(session.experiment)
    (entry,) = experiment.sessions
    assert (entry.file, entry.payload.name, entry.payload.mass) == ("session-00.h5", "disk-7", 6.970)
    np.testing.assert_allclose(experiment.drive_gain, rig.drive_gain)
    samples = experiment.read(entry)
    assert len(samples.time) == len(plan_counts(rig, short_plan))
    assert samples.sampling_period == pytest.approx(rig.cycle)
    wanted = short_plan.setpoints(samples.time - samples.time[0]).position
    assert np.abs(samples.position - wanted).max() < rig.axes[0].limits.following_error


def test_the_recording_holds_what_is_needed_to_read_it_in_ten_years(rig, armed_session, short_plan):
    session = armed_session(rig)
    session.start()
    assert session.wait(60) is SessionState.DONE
    with h5py.File(session.file) as file:
        attributes = dict(file.attrs)
        position, command = file["position"], file["command"]
        np.testing.assert_allclose(position.attrs["matrix"], rig.position_matrix)
        np.testing.assert_allclose(command.attrs["scale"], rig.command_scale)
        assert (file["valid"][:] == 3).all()
        assert (np.diff(file["cycle"][:]) == 1).all()
        np.testing.assert_array_equal(file["setpoint"][:], plan_counts(rig, short_plan))
    assert Rig.model_validate_json(attributes["rig"]) == rig
    assert json.loads(attributes["plan"])["joints"] == ["j3"]
    assert json.loads(attributes["payload"])["name"] == "none"
    assert attributes["status"] == "complete"
    assert attributes["operator"] == "operator"
    assert attributes["clock_source"] == "clock of the virtual bus"
    assert attributes["started"].endswith("+00:00")
    counters = json.loads(attributes["counters"])
    assert counters["alignment"]["lost"] == [0]
    assert counters["sync"]["missed_deadlines"] == 0
    assert raw_log_of(session.file).stat().st_size > 100_000


def test_the_same_session_gives_the_same_numbers_every_time(rig, armed_session):
    positions = []
    for _ in range(2):
        session = armed_session(rig, seed=5)
        session.start()
        assert session.wait(60) is SessionState.DONE
        with h5py.File(session.file) as file:
            positions.append((file["position"][:], file["command"][:], file["sync_time"][:]))
        session.close()
    for first, second in zip(*positions, strict=True):
        np.testing.assert_array_equal(first, second)


def test_nothing_moves_before_the_operator_starts(rig, armed_session):
    session = armed_session(rig)
    assert session.wait(0.5) is SessionState.ARMED
    assert session.progress.cycle == 0
    assert len(session.live(10).time) == 0


def test_a_step_out_of_turn_is_refused_and_changes_nothing(rig, tmp_path, short_plan):
    with PayloadSession(rig, tmp_path / "e", short_plan, rig.payload("none"), "operator") as session:
        for step in (session.arm, session.start, lambda: session.confirm_payload(0.0)):
            with pytest.raises(StepOutOfTurn, match="the session is new"):
                step()
        assert session.state is SessionState.NEW


@pytest.mark.parametrize("step", ["check the rig", "arm", "start"])
def test_nothing_moves_once_a_file_that_the_session_stands_on_is_another(rig, tmp_path, short_plan, step):
    file = tmp_path / "arm.yaml"
    file.write_text("limits: narrow")
    folder = tmp_path / "arm"
    with PayloadSession(
        rig, folder, short_plan, rig.payload("none"), "operator", made_from=FilesAsRead.of([file])
    ) as session:

        def steps():
            for name, take in (
                ("check the rig", session.check),
                ("confirm", lambda: session.confirm_payload(0.0)),
                ("arm", session.arm),
                ("start", session.start),
            ):
                if name == step:
                    file.write_text("limits: wide")
                take()

        with pytest.raises(StepOutOfTurn) as refused:
            steps()
        reason = f"{file} was changed since it was read for this session; check the rig again"
        assert str(refused.value) == f"cannot {step}: {reason}"
        assert session.state is SessionState.ABORTED
        assert session.reason.startswith(reason)
        assert session.progress.cycle == 0
    assert not (folder / "session-00.h5").exists()


def test_a_payload_of_another_mass_is_refused(rig, tmp_path, short_plan):
    with PayloadSession(rig, tmp_path / "e", short_plan, rig.payload("disk-7"), "operator") as session:
        session.check()
        with pytest.raises(InputError, match=r"disk-7: weighs 6.97 kg .* 3.4584 kg on the scale"):
            session.confirm_payload(3.4584)
        assert session.state is SessionState.CHECKED
    assert not (tmp_path / "e").exists()


def test_a_plan_beyond_the_limits_is_refused_before_anything_is_touched(rig, tmp_path, short_plan):
    slow = with_limits(rig, velocity=0.2)
    with pytest.raises(InputError, match=r"joint j3: velocity .* beyond the limit"):
        PayloadSession(slow, tmp_path / "e", short_plan, rig.payload("none"), "operator")
    assert not (tmp_path / "e").exists()


def test_the_operators_stop_brings_the_axis_to_rest_and_keeps_the_data(rig, armed_session):
    session = armed_session(rig, plan=standard_plan(rig, 120.0))
    session.start()
    while session.progress.cycle < 500 and not session.state.ended:
        session.wait(0.01)
    assert 1 <= len(session.live(20 * rig.cycle).time) <= 20
    session.stop("the operator pressed stop")
    assert session.wait(30) is SessionState.ABORTED
    assert "the operator pressed stop" in session.reason
    assert session.file.parent.name == "incomplete"
    with h5py.File(session.file) as file:
        assert file.attrs["status"] == "aborted"
        last = file["position"][-20:, 0]
        assert len(file["position"]) > 100
        assert np.ptp(last) * rig.position_matrix[0, 0] < 1e-4, "the axis rests at the end"
    assert load_experiment(session.experiment).sessions == ()


def test_a_session_that_was_closed_without_a_start_leaves_no_recording(rig, armed_session):
    session = armed_session(rig)
    session.close()
    assert session.state is SessionState.ABORTED
    assert not session.experiment.exists()


@pytest.mark.parametrize(
    ("faults", "words"),
    [
        ({"emergency_at": 2000, "emergency_code": 0x4310}, r"EMCY 0x4310 motor or transmission too hot"),
        ({"freeze_at": 2000}, "no position from the drive"),
        ({"glitch_cycles": [2000], "glitch_counts": 1_000_000}, "following error|velocity|position"),
        ({"saturate_from": 2000, "saturate_factor": 0.1}, "following error|left OPERATION ENABLED|EMCY"),
    ],
)
def test_a_failing_drive_ends_the_motion_with_its_reason_and_keeps_the_data(
    rig, armed_session, faults, words
):
    session = armed_session(with_faults(rig, **faults))
    session.start()
    assert session.wait(60) is SessionState.FAULTED
    assert re.search(words, session.reason), session.reason
    with h5py.File(session.file) as file:
        assert file.attrs["status"] == "faulted"
        assert len(file["position"]) > 500


def test_lost_and_late_answers_are_marked_exactly(rig, armed_session):
    """The plan of faults says which cycles; the recording must show these and no others."""
    session = armed_session(with_faults(rig, lose_cycles=[2000, 2001, 3000], late_cycles=[2500, 2600]))
    session.start()
    assert session.wait(60) is SessionState.DONE, session.reason
    with h5py.File(session.file) as file:
        cycle, valid = file["cycle"][:], file["valid"][:, 0]
        counters = json.loads(file.attrs["counters"])["alignment"]
    assert cycle[valid == 0].tolist() == [2000, 2001, 3000]
    assert cycle[(valid & 4) != 0].tolist() == [2500, 2600]
    assert (valid[(valid & 4) != 0] & 3 == 3).all()
    assert (counters["lost"], counters["late"]) == ([3], [2])


def test_two_threads_that_close_a_session_at_once_close_it_once_and_both_wait(
    rig, armed_session, monkeypatch
):
    """A service that ends closes a session that somebody has just closed: one of them met a pipe that was gone."""
    session = armed_session(rig)
    closed, inside = session.processes.close, threading.Lock()
    reached, other_back, clashes = threading.Event(), threading.Event(), []

    def watched():
        if not inside.acquire(blocking=False):
            clashes.append("both at once")
            return
        reached.set()
        other_back.wait(0.5)
        closed()
        inside.release()

    monkeypatch.setattr(session.processes, "close", watched)
    with ThreadPoolExecutor(2) as threads:
        first = threads.submit(session.close)
        assert reached.wait(60)
        threads.submit(session.close).add_done_callback(lambda _: other_back.set())
        first.result(60)
    assert other_back.is_set()
    assert not clashes


def test_a_second_session_takes_the_next_number(rig, armed_session):
    sessions = []
    for number in range(2):
        session = armed_session(rig)
        sessions.append(session)
        session.start()
        assert session.wait(60) is SessionState.DONE
        assert session.file.name == f"session-{number:02d}.h5"
        session.close()
    assert len(load_experiment(sessions[0].experiment).sessions) == 2


def test_another_robots_experiment_is_refused(rig, tmp_path):
    folder = tmp_path / "experiment"
    open_experiment(folder, rig)
    other = rig.model_copy(
        update={
            "robot": rig.robot.model_copy(
                update={"joints": (rig.robot.joints[0].model_copy(update={"name": "j9"}),)}
            ),
            "axes": (rig.axes[0].model_copy(update={"joint": "j9"}),),
        }
    )
    plan = standard_plan(other, 20.0)
    with (
        PayloadSession(other, folder, plan, rig.payload("none"), "operator") as second,
        pytest.raises(InputError, match="record into another experiment"),
    ):
        second.check()


def test_the_raw_log_is_read_back_by_python_can(rig, armed_session):
    session = armed_session(rig)
    session.start()
    assert session.wait(60) is SessionState.DONE
    messages = list(can.LogReader(raw_log_of(session.file)))
    with h5py.File(session.file) as file:
        rows = len(file["cycle"])
        counts = file["position"][:, 0]
    syncs = [message for message in messages if message.arbitration_id == 0x80]
    answers = [message for message in messages if message.arbitration_id == 0x183]
    assert len(syncs) >= rows
    positions = np.array([int.from_bytes(message.data[:4], "little", signed=True) for message in answers])
    assert any(np.array_equal(positions[k : k + rows], counts) for k in range(len(positions) - rows + 1))


def test_the_raw_log_is_read_by_can_utils_frame_by_frame(rig, armed_session, tmp_path):
    if shutil.which("log2asc") is None:
        pytest.skip("log2asc is not installed (Debian package can-utils)")
    session = armed_session(rig)
    session.start()
    assert session.wait(60) is SessionState.DONE
    log, asc, back = tmp_path / "session.log", tmp_path / "session.asc", tmp_path / "back.log"
    log.write_bytes(b"".join(text_of(raw_log_of(session.file))))
    channel = log.read_text().split(maxsplit=2)[1]
    subprocess.run(["log2asc", "-I", log, "-O", asc, channel], check=True, timeout=60)
    subprocess.run(["asc2log", "-I", asc, "-O", back], check=True, timeout=60)
    recorded = [line.split()[2] for line in log.read_text().splitlines()]
    assert len(recorded) > 1000
    assert [line.split()[2] for line in back.read_text().splitlines()] == recorded


def test_a_rig_that_is_neither_checked_nor_given_up_in_time_is_said_to_be_so(
    rig, tmp_path, short_plan, monkeypatch
):
    """On a computer so slow that even giving up takes longer than it is waited for, the words say what was waited for."""
    with PayloadSession(rig, tmp_path / "e", short_plan, rig.payload("none"), "operator") as session:
        with monkeypatch.context() as slow:
            slow.setattr("daq.session_workflow._CHECK_TIMEOUT", 0.0)
            slow.setattr("daq.session_workflow._CLOSE_TIMEOUT", 0.0)
            with pytest.raises(StepOutOfTurn, match="could not be checked: the rig was not checked in time"):
                session.check()
        assert session.state is SessionState.FAULTED
        assert session.reason.startswith("the rig was not checked in time")
