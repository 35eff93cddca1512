"""What the pages of a proof show: plans and payloads to choose, its two drives, and what became of the following error."""

import numpy as np
import pytest

from api.compensation_text import HELD_OVER_THE_BUS
from api.pages import proofs_page
from api.pages.figures.following_error import Following
from api.pages.proofs_page import ResultView, _drive, _payloads, _plans, _result
from api.pages.stored_models import StoredExperiment
from api.proof import FollowingErrors
from api.service.accounts import Role, User
from api.service.database import SessionRow
from api.service.proofs import ProofState
from daq.session_events import SessionState
from identify.recording import Payload
from identify.results.compensation import CompensationDocument, JointFollowing
from tests.api.conftest import RIG
from tests.api.driven_arm import short_plan
from tests.api.proof_settings import proof_settings

ARM = "rx130l-joint3"


@pytest.fixture
def stored(laboratory) -> StoredExperiment:
    return StoredExperiment(laboratory.service.experiments, ARM)


def result(completed: bool = True, joint: str = "j3", held_by: str = "drive") -> CompensationDocument:
    following = JointFollowing(
        joint=joint,
        unit="rad",
        rms_without=1e-3,
        rms_with=2e-4,
        peak_without=2e-3,
        peak_with=1e-3,
        largest_offset=3.0,
        bounded=0.0,
        speeds=(),
        quadrants=(),
    )
    return CompensationDocument(
        experiment=ARM,
        rig=RIG,
        payload="none",
        model="usual",
        part="whole",
        share=0.6,
        recording_without="session-00.h5",
        recording_with="session-01.h5",
        completed=completed,
        reason="the plan ran to its end",
        following_limits=(3e-3,),
        joints=(following,),
        folder="compensation/00",
        held_by=held_by,
        remarks=(),
    )


@pytest.fixture
def state(rig):
    """A proof with drives of these states, and that result."""

    def of(
        without: SessionState | None = None,
        with_: SessionState | None = None,
        concluded: CompensationDocument | None = None,
    ) -> ProofState:
        rows = [
            None
            if each is None
            else SessionRow(
                experiment=ARM,
                id=f"proof-00-{drive}",
                file=None,
                payload=Payload(name="none", mass=0.0),
                role="identification",
                rig=RIG,
                plan="short",
                state=each.value,
                reason="following error of j3",
                created=0.0,
            )
            for drive, each in (("without", without), ("with", with_))
        ]
        settings = proof_settings(rig, ARM, Payload(name="none", mass=0.0))
        return ProofState("00", settings, *rows, concluded)

    return of


def test_a_drive_is_done_under_way_or_says_why_it_ended(laboratory, state):
    def drive(which, of):
        return _drive(laboratory.service, of, which, "words")

    without = drive("without", state(SessionState.DONE))
    assert (without.done, without.under_way, without.said) == (True, False, "")
    assert without.link == f"/pages/experiments/{ARM}/sessions/proof-00-without"
    assert without.prepare_link == f"/pages/experiments/{ARM}/proofs/00/drives/without"
    new = drive("with", state(SessionState.DONE, SessionState.NEW))
    assert (new.done, new.under_way, new.said) == (False, True, "")
    for ended, title in (
        (SessionState.ABORTED, "The run was stopped."),
        (SessionState.FAULTED, "A fault ended"),
    ):
        stopped = drive("with", state(SessionState.DONE, ended))
        assert (stopped.done, stopped.under_way) == (False, False)
        assert stopped.said.startswith(title)
        assert "ollowing error of j3" in stopped.said


@pytest.mark.parametrize("completed", [True, False])
def test_drives_of_the_command_line_are_done_as_far_as_their_result_says(laboratory, state, completed):
    of = state(concluded=result(completed))
    drives = {which: _drive(laboratory.service, of, which, title) for which, title in proofs_page.DRIVES}
    assert {which: each.done for which, each in drives.items()} == {"without": True, "with": completed}
    assert [each.link for each in drives.values()] == [None, None]
    nothing = _drive(laboratory.service, state(), "without", "words")
    assert (nothing.done, nothing.under_way, nothing.link) == (False, False, None)


def test_following_errors_are_in_thousandths_with_the_limit_of_their_joint(
    laboratory, stored, state, monkeypatch
):
    errors = FollowingErrors(
        time=np.array([0.0, 1.0]),
        position=np.array([[0.5], [0.6]]),
        before=np.array([[1e-3], [2e-3]]),
        after=np.array([[1e-4], [np.nan]]),
    )
    drawn: list[Following] = []
    monkeypatch.setattr(laboratory.service.proofs, "errors", lambda experiment, number: errors)
    monkeypatch.setattr(proofs_page, "draw_following_error", lambda joint, each, **_: drawn.append(each))
    view = _result(laboratory.service, stored, state(concluded=result()), "j3")
    assert (view.completed, view.small, view.limit) == (True, "mrad", 3.0)
    assert view.held_over_the_bus == ""
    assert [row.without for row in view.rows] == [1.0, 2.0]
    wide, narrow = drawn
    assert wide is narrow
    np.testing.assert_allclose(wide.before, [1.0, 2.0])
    np.testing.assert_allclose(wide.after, [0.1, np.nan])
    np.testing.assert_allclose(wide.position, [0.5, 0.6])
    assert (wide.limit, wide.small, wide.unit) == (3.0, "mrad", "rad")
    held = _result(laboratory.service, stored, state(concluded=result(held_by="this computer")), "j3")
    assert held.held_over_the_bus == HELD_OVER_THE_BUS


def test_without_errors_of_the_joint_there_is_only_how_it_ended(laboratory, stored, state):
    assert _result(laboratory.service, stored, state(), "j3") is None
    other = _result(laboratory.service, stored, state(concluded=result(False, "j4")), "j3")
    assert other == ResultView(False, "the plan ran to its end")


def test_plans_of_these_joints_and_payloads_of_both_are_offered(laboratory, stored, rig):
    plans = laboratory.service.plans
    plans.add(short_plan("short"))
    plans.add(short_plan("of another joint").model_copy(update={"joints": ("j4",)}))
    (shown,) = _plans(laboratory.service, stored)
    assert (shown.name, shown.driven) == ("short", False)
    assert shown.seconds == short_plan("short").duration
    offered = dict(_payloads(stored, rig))
    assert {each.name for each in rig.payloads} <= offered.keys()
    assert offered["disk 7 kg"] == 6.97


def test_a_page_that_waits_is_drawn_again_once_a_drive_has_gone_further(laboratory, state, monkeypatch):
    viewer = laboratory.client(Role.VIEWER)
    monkeypatch.setattr(laboratory.service.proofs, "progress", lambda experiment, proof: "new")
    monkeypatch.setattr(laboratory.service.proofs, "remarks", lambda experiment, proof: ())
    address = f"/pages/experiments/{ARM}/proofs/00/news"
    # before the first run too: another operator may have prepared it
    for of, asks in ((state(), True), (state(SessionState.DONE), True), (state(concluded=result()), False)):
        monkeypatch.setattr(laboratory.service.proofs, "get", lambda experiment, proof, of=of: of)
        monkeypatch.setattr(laboratory.service.proofs, "errors", lambda experiment, proof: None)
        assert (f'hx-get="{address}?seen=new"' in viewer.get(address.removesuffix("/news")).text) is asks
    assert "hx-refresh" not in viewer.get(address, params={"seen": "new"}).headers
    assert viewer.get(address, params={"seen": ""}).headers["hx-refresh"] == "true"


def test_a_run_is_continued_by_who_operates_the_rig_and_watched_by_everybody_else(
    laboratory, state, monkeypatch
):
    service = laboratory.service
    monkeypatch.setattr(service.proofs, "get", lambda experiment, proof: state(SessionState.RUNNING))
    monkeypatch.setattr(service.proofs, "progress", lambda experiment, proof: "moves")
    monkeypatch.setattr(service.proofs, "remarks", lambda experiment, proof: ())
    clients = {
        "ada": laboratory.client(Role.OPERATOR, "ada"),
        "grace": laboratory.client(Role.OPERATOR, "grace"),
        "vera": laboratory.client(Role.VIEWER, "vera"),
    }

    def continued_by():
        pages = {
            name: client.get(f"/pages/experiments/{ARM}/proofs/00").text for name, client in clients.items()
        }
        assert all("The first run is under way." in text for text in pages.values())
        told = {name for name, text in pages.items() if "ada operates the rig." in text}
        offered = {name for name, text in pages.items() if "Continue the run</a>" in text}
        assert all(("See the run</a>" in text) is (name not in offered) for name, text in pages.items())
        return offered, told

    # after a restart of the service nobody operates the rig until an operator goes on
    assert continued_by() == ({"ada", "grace"}, set())
    ada = User("ada", Role.OPERATOR, "token")
    service.operators.take(RIG, ada)
    assert continued_by() == ({"ada"}, {"grace", "vera"})
    service.operators.release(RIG, ada)
