"""The form of a new session: planning a motion from it, followed until the form comes back with the plan chosen."""

from types import SimpleNamespace
from urllib.parse import parse_qs, urlsplit

import pytest

from api.service.accounts import Role
from api.service.job_documents import JobResult
from api.service.jobs import JobState
from daq.excitation.standard_plan import standard_plan
from daq.rig import Rig
from tests.api.rig_session import RIG

KEPT = {"rig": "bench", "experiment": "arm", "payload": "disk-7"}


@pytest.fixture
def followed(service, monkeypatch):
    """What the page shows of a planning in this state."""
    client = service.client(Role.OPERATOR)

    def follow(state: JobState, **more):
        job = SimpleNamespace(
            id="j1", kind="plan", state=state, fraction=0.4, words="the ways are drawn", **more
        )
        monkeypatch.setattr(
            service.service.jobs, "get", lambda identifier: job if identifier == "j1" else None
        )
        return client.get(
            "/pages/plans/progress", params={"job": "j1", **KEPT}, headers={"Accept": "text/html"}
        )

    return follow


def test_a_planning_is_polled_with_what_the_form_held(followed):
    answer = followed(JobState.RUNNING)
    assert "the ways are drawn" in answer.text
    assert "/pages/plans/progress?job=j1&amp;rig=bench&amp;experiment=arm&amp;payload=disk-7" in answer.text
    assert "HX-Redirect" not in answer.headers


def test_a_plan_that_was_made_is_chosen_in_the_form_as_it_was(followed):
    there = urlsplit(followed(JobState.DONE, result=JobResult(plan="bench-60-s")).headers["HX-Redirect"])
    assert there.path == "/pages/new-session"
    assert parse_qs(there.query) == {name: [value] for name, value in {**KEPT, "plan": "bench-60-s"}.items()}


@pytest.mark.parametrize("state", [JobState.FAILED, JobState.CANCELLED])
def test_a_planning_that_failed_says_that_no_plan_was_made_and_why(followed, state):
    answer = followed(state)
    assert "No plan was made: the ways are drawn." in answer.text
    assert "HX-Redirect" not in answer.headers


def test_an_experiment_is_not_made_for_a_session_that_cannot_be_prepared(service):
    client = service.client(Role.OPERATOR)
    held = service.service
    other = Rig.load("tx40-simulated")
    plan = held.plans.add(standard_plan(other, 20.0, name="of another robot"))
    form = {"rig": RIG, "experiment": "new", "experiment_name": "arm", "payload": "none", "plan": plan}
    answer = client.post("/pages/new-session", data=form, headers={"Accept": "text/html"})
    assert answer.status_code == 422
    assert held.experiments.rows() == []
    assert held.operators.operator(RIG) is None
