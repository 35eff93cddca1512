"""What a session says when its motion has ended, and what it leaves on disk, for every state of its recording."""

import h5py
import numpy as np
import pytest

from daq.experiment_folder import claim_recording, open_experiment
from daq.raw_log import raw_log_of
from daq.safety import StopCause, StopReason
from daq.session_events import SessionState, StepOutOfTurn
from daq.session_outcome import NOTHING_KEPT, Outcome, error_in_words, outcome_of
from identify.recording import load_experiment

PLAN_DONE = StopReason(StopCause.PLAN_DONE, "the plan was driven to its end")
LIMIT = StopReason(StopCause.LIMIT, "joint j3: too fast")
OPERATOR = StopReason(StopCause.OPERATOR, "operator's stop")


@pytest.fixture
def experiment(tmp_path, rig):
    folder = tmp_path / "arm"
    open_experiment(folder, rig)
    return folder


def write_recording(path, rig, status, reason, rows=3):
    """As the recorder leaves a file."""
    with h5py.File(path, "w", libver="latest") as file:
        for name in ("cycle", "sync_time"):
            file.create_dataset(name, data=np.arange(rows) * 2_000_000)
        for name in ("position", "command", "setpoint", "valid"):
            file.create_dataset(name, data=np.zeros((rows, len(rig.axes)), np.int32))
        payload = rig.payload("none").model_dump_json()
        file.attrs.update({"format": 1, "status": status, "status_reason": reason, "payload": payload})


@pytest.fixture
def outcome(experiment, rig):
    """What became of a session with the recording that `write` makes."""

    def of(reason: StopReason, write=None) -> Outcome:
        file = claim_recording(experiment)
        if write is not None:
            write(file)
        return outcome_of(reason, experiment, file, rig.payload("none"), "identification", None)

    return of


@pytest.mark.parametrize(
    ("reason", "state"), [(OPERATOR, SessionState.ABORTED), (LIMIT, SessionState.FAULTED)]
)
def test_without_a_file_the_reason_is_all_and_the_claimed_number_is_given_back(
    experiment, outcome, reason, state
):
    assert outcome(reason) == Outcome(state, reason.words, None)
    assert list((experiment / "incomplete").iterdir()) == []


def test_a_session_that_was_never_armed_has_only_its_reason(experiment, rig):
    ended = outcome_of(OPERATOR, experiment, None, rig.payload("none"), "identification", None)
    assert ended == Outcome(SessionState.ABORTED, "operator's stop", None)


@pytest.mark.parametrize(("reason", "more"), [(LIMIT, f"; {NOTHING_KEPT}"), (OPERATOR, "")])
def test_a_recording_without_a_row_is_not_kept_and_a_fault_says_where_to_look(
    experiment, rig, outcome, reason, more
):
    ended = outcome(reason, lambda file: write_recording(file, rig, reason.status, reason.words, rows=0))
    assert (ended.sentence, ended.file) == (reason.words + more, None)
    assert list((experiment / "incomplete").iterdir()) == []


@pytest.mark.parametrize(
    ("status", "state"), [("aborted", SessionState.ABORTED), ("faulted", SessionState.FAULTED)]
)
def test_what_is_kept_of_a_session_that_was_stopped_and_how_it_may_serve(
    experiment, rig, outcome, status, state
):
    ended = outcome(OPERATOR, lambda file: write_recording(file, rig, status, "the recorder's reason"))
    assert ended.state is state
    assert ended.sentence == (
        "the recorder's reason; 3 samples are kept in incomplete/session-00.h5; "
        f"`coulomb recover {experiment}` lists them in the experiment if they may serve identification"
    )
    assert ended.file == experiment / "incomplete" / "session-00.h5"


@pytest.mark.parametrize("status", ["aborted", "complete"])
def test_a_run_of_a_pair_that_is_not_whole_is_driven_again_and_not_recovered(experiment, rig, status):
    file = claim_recording(experiment)
    write_recording(file, rig, status, "the recorder's reason")
    (experiment / "experiment.yaml").write_text("nothing")  # what is complete cannot be listed either
    ended = outcome_of(OPERATOR, experiment, file, rig.payload("none"), "validation", None, admissible=False)
    assert "recover" not in ended.sentence
    assert ended.sentence.endswith("; only a run that was driven to its end is compared: drive it again")


def test_a_recording_that_its_recorder_left_open_is_closed_as_faulted(experiment, rig, outcome):
    ended = outcome(OPERATOR, lambda file: write_recording(file, rig, "recording", ""))
    assert ended.state is SessionState.FAULTED
    assert ended.sentence.startswith("the recorder process died; operator's stop; 3 samples are kept in")
    with h5py.File(ended.file) as file:
        assert file.attrs["status"] == "faulted"


def test_a_damaged_recording_is_named_and_stays(outcome):
    ended = outcome(PLAN_DONE, lambda file: file.write_bytes(b"no HDF5"))
    assert ended.state is SessionState.FAULTED
    assert "; the recording is damaged: " in ended.sentence
    assert ended.file.read_bytes() == b"no HDF5"


def test_a_complete_recording_is_listed_in_the_experiment(experiment, rig, outcome):
    ended = outcome(PLAN_DONE, lambda file: write_recording(file, rig, "complete", PLAN_DONE.words))
    assert ended == Outcome(
        SessionState.DONE,
        "the plan was driven to its end; 3 samples in session-00.h5",
        experiment / "session-00.h5",
    )
    assert ended.file.exists()
    assert raw_log_of(ended.file).exists()
    assert [entry.file for entry in load_experiment(experiment).sessions] == ["session-00.h5"]


def test_a_complete_recording_that_cannot_be_listed_says_how_it_can_be_later(experiment, rig, outcome):
    def write(file):
        write_recording(file, rig, "complete", PLAN_DONE.words)
        (experiment / "experiment.yaml").write_text("format: 1\n")

    ended = outcome(PLAN_DONE, write)
    assert ended.state is SessionState.FAULTED
    assert "3 samples, all of the plan, are in incomplete/session-00.h5, but they could not be listed: " in (
        ended.sentence
    )
    assert ended.sentence.endswith(f"put that right, then `coulomb recover {experiment}` lists them")
    assert ended.file.exists()


@pytest.mark.parametrize(
    ("error", "sentence"),
    [
        (StepOutOfTurn("not now"), "not now"),
        (OSError(28, "No space left on device", "/data/arm"), "/data/arm: No space left on device"),
        (OSError(), "the system refused without a reason"),
        (
            ZeroDivisionError(),
            "an error of the software (ZeroDivisionError: without words); please report it",
        ),
    ],
)
def test_an_error_in_an_operators_words(error, sentence):
    assert error_in_words(error) == sentence
