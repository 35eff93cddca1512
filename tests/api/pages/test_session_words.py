"""What became of a session, in one sentence with one next step; also after the service was started again."""

from types import SimpleNamespace

import pytest

from api.pages.session_words import STATES, outcome
from daq.session_events import SessionState
from identify.recording.experiment_file import Payload


def row(state: str, file: str | None = "session-00.h5", reason: str | None = None, payload: str = "none"):
    return SimpleNamespace(
        experiment="arm",
        id="session-00",
        rig="bench",
        plan="bench-20-s",
        state=state,
        file=file,
        reason=reason,
        payload=Payload(name=payload, mass=1.0),
    )


def service(*measured, active=None):
    """A service with the rig `bench` and two payloads, whose experiment holds these sessions."""
    payloads = [SimpleNamespace(name=name) for name in ("none", "disk-7")]
    return SimpleNamespace(
        sessions=SimpleNamespace(active=lambda _rig: active, reason=lambda each: each.reason),
        rigs=SimpleNamespace(files=lambda: ["bench"], rig=lambda _name: SimpleNamespace(payloads=payloads)),
        experiments=SimpleNamespace(
            sessions=lambda _experiment: list(measured), row=lambda _id: SimpleNamespace(name="Arm 2")
        ),
    )


def active(state: SessionState, reason: str = ""):
    return SimpleNamespace(experiment="arm", id="session-00", state=state, reason=reason)


def test_after_a_session_the_next_payload_is_the_next_step():
    done = outcome(service(), row("done", reason="the plan ran to its end; 24000 samples in session-00.h5"))
    assert done.words == "session-00 of Arm 2: the plan ran to its end; 24000 samples in session-00.h5."
    assert done.step.words == "Next payload: disk-7"
    assert "rig=bench&experiment=arm&payload=disk-7&plan=bench-20-s" in done.step.link


def test_once_all_payloads_are_measured_the_result_is_the_next_step():
    done = outcome(service(row("done", payload="disk-7")), row("done"))
    assert done.step.words == "See the result"
    assert done.step.link.endswith("/experiments/arm/model")


def test_what_is_advised_for_the_command_line_is_not_said_on_a_page():
    reason = (
        "stopped by ada; 12 samples are kept in incomplete/session-00.h5; `coulomb recover arm` lists them"
    )
    stopped = outcome(service(active=active(SessionState.ABORTED, reason)), row("aborted"))
    assert stopped.words == "Stopped by ada; 12 samples are kept in incomplete/session-00.h5."
    assert stopped.step.words == "Prepare it again"


@pytest.mark.parametrize(
    ("stored", "said", "step"),
    [
        (
            row("recording"),
            "The service ended while session-00 of Arm 2 was recorded.",
            "Recover the recording",
        ),
        (row("payload confirmed", file=None), "Check the rig again.", "Continue the session"),
        (row("new", file=None), "session-00 of Arm 2 is being prepared.", "Continue the session"),
        (
            row("faulted", reason="drive 3: too hot"),
            "session-00 of Arm 2: drive 3: too hot.",
            "Prepare it again",
        ),
    ],
)
def test_after_the_service_was_started_again_each_session_has_an_end_and_a_next_step(stored, said, step):
    told = outcome(service(), stored)
    assert said in told.words
    assert told.step.words == step


def test_nothing_is_over_while_the_robot_moves():
    assert outcome(service(active=active(SessionState.RUNNING)), row("running")) is None


def test_every_state_has_its_words():
    assert set(STATES) == set(SessionState)
