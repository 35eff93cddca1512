"""The two sessions of a proof: which is driven with what, when a proof is forgotten, and when it is half."""

from types import SimpleNamespace

import pytest

from api import compensation_run
from api.compensation_run import PICTURE, CompensationRun
from daq.session_events import SessionState


class Proof:
    """A proof that only notes what is asked of it."""

    def __init__(self, folder) -> None:
        self.folder = folder
        self.settings = SimpleNamespace(payload="disk", operator="ada")
        self.rig, self.plan = "rig", "plan"
        self.concluded = []

    def store(self):
        self.folder.mkdir(parents=True)
        return self

    def first(self):
        return "nothing"

    def first_run(self):
        return self.folder / "first.h5"

    def sent(self, without):
        return f"torque bounded by {without.name}"

    def words(self, without):
        return [f"j1 by {without.name}", "j2"]

    def conclude(self, without, with_, completed, reason):
        self.concluded.append((without.name, with_.name, completed, reason))
        return "document"


@pytest.fixture
def sessions(monkeypatch):
    """The sessions that are opened, with what each is to send."""
    opened = []

    def session(rig, folder, plan, payload, operator, role, seed, ahead, **named):
        made = SimpleNamespace(
            file=None, state=SessionState.NEW, reason="", ahead=ahead, seed=seed, role=role
        )
        opened.append(made)
        return made

    monkeypatch.setattr(compensation_run, "PayloadSession", session)
    return opened


@pytest.fixture
def proof(tmp_path):
    return Proof(tmp_path / "compensation" / "01")


def driven(session, file, state=SessionState.DONE):
    file.touch()
    session.file, session.state, session.reason = file, state, state.value


def test_the_second_run_is_bounded_by_the_first_and_both_are_for_validation(proof, sessions):
    run = CompensationRun(proof, seed=3)
    driven(run.without(), proof.folder / "a.h5")
    assert run.words() == "j1 by a.h5; j2"
    run.with_torque()
    assert [(each.ahead, each.seed, each.role) for each in sessions] == [
        ("nothing", 3, "validation"),
        ("torque bounded by a.h5", 3, "validation"),
    ]


def test_a_proof_that_is_continued_is_bounded_by_the_run_of_then(proof, sessions):
    proof.store()
    run = CompensationRun.continued(proof, seed=4)
    run.with_torque()
    ((ahead, seed),) = [(each.ahead, each.seed) for each in sessions]
    assert (ahead, seed) == ("torque bounded by first.h5", 4)


def test_a_proof_is_half_until_its_second_run_has_a_recording(proof, sessions):
    run = CompensationRun(proof)
    driven(run.without(), proof.folder / "a.h5")
    assert run.is_half
    second = run.with_torque()
    assert run.is_half
    second.file = proof.folder / "b.h5"
    assert run.is_half  # named, and never begun
    driven(second, proof.folder / "b.h5")
    assert not run.is_half


@pytest.mark.parametrize("other", [False, True])
def test_a_proof_whose_first_run_left_no_recording_is_forgotten_and_no_other(proof, sessions, other):
    if other:
        (proof.folder.parent / "02").mkdir(parents=True)
    run = CompensationRun(proof)
    run.forget_unless_driven()  # nothing was begun
    session = run.without()
    session.file = proof.folder / "a.h5"
    assert proof.folder.is_dir()
    run.forget_unless_driven()
    assert not proof.folder.exists()
    assert proof.folder.parent.exists() is other


def test_a_proof_whose_first_run_is_recorded_is_kept(proof, sessions):
    run = CompensationRun(proof)
    driven(run.without(), proof.folder / "a.h5", SessionState.ABORTED)
    run.forget_unless_driven()
    assert (proof.folder / "a.h5").exists()


@pytest.mark.parametrize("state", [SessionState.DONE, SessionState.ABORTED, SessionState.FAULTED])
def test_what_came_of_it_is_concluded_once_with_a_picture(proof, sessions, monkeypatch, state):
    monkeypatch.setattr(compensation_run, "read_errors", lambda folder: f"errors of {folder.name}")
    monkeypatch.setattr(compensation_run, "draw", lambda rig, errors: f"{rig}: {errors}".encode())
    run = CompensationRun(proof)
    driven(run.without(), proof.folder / "a.h5")
    driven(run.with_torque(), proof.folder / "b.h5", state)
    assert run.document() == "document"
    assert proof.concluded == [("a.h5", "b.h5", state is SessionState.DONE, state.value)]
    assert (proof.folder / PICTURE).read_bytes() == b"rig: errors of 01"
