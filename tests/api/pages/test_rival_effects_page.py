"""The experiment that tells rivals apart, asked for on the page: when a search begins, how it is followed, and its plan."""

from urllib.parse import parse_qs, urlsplit

import pytest

from api.service.accounts import Role
from api.service.job_documents import JobState
from api.service.jobs import Job
from api.service.separating_plans import MadePlan

ARM = "rx130l-joint3"
APART = f"/pages/experiments/{ARM}/missing/apart"


def job(kind: str, state: JobState = JobState.RUNNING, identifier: str = "a1") -> Job:
    return Job(identifier, kind, ARM, "ada", state, 0.5, "half way", 0.0)


@pytest.fixture
def page(laboratory):
    client = laboratory.client(Role.OPERATOR)
    client.headers["Accept"] = "text/html"
    return client


@pytest.mark.parametrize(
    ("under_way", "begun", "followed"),
    [
        ((), True, "s1"),
        (("refit",), True, "s1"),
        (("separate",), False, "a1"),
        (("diagnose",), False, None),
        (("refit", "separate"), False, "a1"),
    ],
)
def test_a_search_begins_only_where_nothing_but_earlier_versions_is_computed(
    laboratory, page, monkeypatch, under_way, begun, followed
):
    jobs = [job(kind) for kind in under_way]
    asked = []

    def separate(*given):
        asked.append(given)
        return job("separate", identifier="s1")

    monkeypatch.setattr(laboratory.service.models, "separate", separate)
    monkeypatch.setattr(laboratory.service.jobs, "unfinished", lambda _: jobs)
    monkeypatch.setattr(laboratory.service.jobs, "get", lambda each: job("separate", identifier=each))
    text = page.post(APART).text
    assert asked == [(ARM, "the-operator", "j3")] * begun
    assert (f'hx-get="{APART}?joint=j3&amp;job={followed}"' in text) == (followed is not None)
    assert ("half way" in text) == (followed is not None)
    assert "load, click" not in text  # what was asked for once is not begun again by itself


@pytest.mark.parametrize(
    ("state", "polled", "said"),
    [
        (JobState.QUEUED, True, False),
        (JobState.RUNNING, True, False),
        (JobState.DONE, False, False),
        (JobState.FAILED, False, True),
        (JobState.CANCELLED, False, True),
    ],
)
def test_a_search_is_followed_and_what_ended_it_is_said(laboratory, page, monkeypatch, state, polled, said):
    monkeypatch.setattr(laboratory.service.jobs, "get", {"a1": job("separate", state)}.get)
    text = page.get(APART, params={"job": "a1"}).text
    assert ("50 % · half way" in text) == polled
    assert ("No experiment was found: half way" in text) == said
    assert ("hx-get=" in text) == polled
    assert page.get(APART, params={"job": "unknown"}).status_code == 200
    assert page.get(APART, params={"joint": "j9"}).status_code == 404


def test_the_plan_of_a_proposal_is_carried_to_a_new_session(laboratory, page, monkeypatch):
    asked = []

    def plan(*given):
        asked.append(given)
        return MadePlan(plan="apart-1", rig="bench", payload="disk 7 kg", remarks=())

    monkeypatch.setattr(laboratory.service.separating, "plan", plan)
    there = urlsplit(page.post(f"{APART}/plan").headers["hx-redirect"])
    assert there.path == "/pages/new-session"
    assert parse_qs(there.query) == {
        "rig": ["bench"],
        "experiment": [ARM],
        "payload": ["disk 7 kg"],
        "plan": ["apart-1"],
    }
    assert page.post(f"{APART}/plan?joint=j3&proposal=20").status_code == 204
    assert asked == [(ARM, "j3", 1), (ARM, "j3", 20)]
    for wrong in (0, 21):
        assert page.post(f"{APART}/plan?proposal={wrong}").status_code == 422
