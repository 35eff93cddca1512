"""Jobs on the pages: which is shown where, and how a page follows one until its end."""

from dataclasses import replace

import pytest

from api.pages.job_views import (
    JOB_TITLES,
    failed_fit,
    fit_key,
    job_context,
    job_state,
    news_context,
    polled_progress,
)
from api.pages.stored_models import StoredExperiment
from api.service.accounts import Role
from api.service.database import open_database
from api.service.job_documents import JobResult, JobState
from api.service.jobs import Job, JobRunner
from api.service.model_story import Story

HTML = {"Accept": "text/html"}


@pytest.fixture
def jobs(tmp_path):
    """A queue that is never begun with: what is submitted waits."""
    database = open_database(tmp_path, None)
    yield JobRunner(database, clock=iter(range(100)).__next__)
    database.close()


def submit(jobs: JobRunner, kind: str, experiment: str = "arm") -> Job:
    return jobs.submit(kind, "module:name", dict, lambda _: JobResult(), user="ada", experiment=experiment)


def job(state: JobState, kind: str = "identify", words: str = "half way") -> Job:
    return Job("a1", kind, "arm", "ada", state, 0.5, words, 0.0)


def test_what_runs_beside_a_verdict_does_not_hide_it(jobs):
    nothing = {"running": None, "again": None, "failed": None}
    assert job_state(jobs, "arm", "j1") == nothing
    submit(jobs, "identify", "another")
    submit(jobs, "separate")
    assert job_state(jobs, "arm", "j1") == nothing
    again = submit(jobs, "refit")
    assert job_state(jobs, "arm", "j1") == nothing | {"again": job_context(again, "arm", "j1")}
    running = submit(jobs, "diagnose")
    submit(jobs, "improve")
    assert job_state(jobs, "arm", "j1")["running"] == job_context(running, "arm", "j1")


@pytest.mark.parametrize("state", list(JobState))
def test_only_what_failed_or_was_lost_says_why(jobs, state):
    ended = job(state)
    failed = job_state(jobs, "arm", "j1", ended)["failed"]
    assert failed == ("half way" if state in ("failed", "lost") else None)


def test_the_newest_computation_says_whether_the_first_fit_failed(tmp_path):
    database = open_database(tmp_path, None)
    moments = iter(range(100)).__next__
    first = submit(JobRunner(database, moments), "identify")
    jobs = JobRunner(database, moments)  # after a restart, in which it was lost
    assert failed_fit(jobs, "arm").id == first.id
    assert failed_fit(jobs, "another") is None
    submit(jobs, "identify")
    assert failed_fit(jobs, "arm") is None
    database.close()


def test_progress_is_asked_for_with_what_the_form_held_and_cancelled_where_it_is_shown():
    shown = polled_progress(job(JobState.RUNNING), "/there", {"joint": "j 1"})
    assert shown == {
        "fraction": 0.5,
        "words": "half way",
        "title": JOB_TITLES["identify"],
        "poll_link": "/there?job=a1&joint=j+1",
        "cancel_link": "/pages/jobs/a1/cancel",
    }
    on_steps = job_context(job(JobState.RUNNING, kind="unheard-of"), "arm", None)
    assert on_steps["poll_link"] == "/pages/experiments/arm/steps/progress?job=a1&joint="
    assert on_steps["cancel_link"] == "/pages/experiments/arm/steps/cancel?joint="
    assert on_steps["title"] == "unheard-of"


def test_news_are_asked_for_since_the_fit_that_was_seen(experiments):
    story = StoredExperiment(experiments, "experiment").story
    assert (fit_key(story), fit_key(Story())) == ("m2.f1", "")
    news = news_context("arm", "m2.f1", None, job(JobState.FAILED, words="no sessions"))
    assert news == {
        "news_failed": "no sessions",
        "news_link": "/pages/experiments/arm/news?seen=m2.f1",
        "news_job": None,
    }
    running = news_context("arm", "", job(JobState.RUNNING))
    assert (running["news_failed"], running["news_job"]["fraction"]) == (None, 0.5)


@pytest.fixture
def followed(service, monkeypatch):
    """What a page shows of a prediction of motion in this state."""
    viewer = service.client(Role.VIEWER)

    def follow(state: JobState):
        known = replace(job(state, "simulate"), experiment="arm")
        monkeypatch.setattr(service.service.jobs, "get", {known.id: known}.get)
        return viewer.get("/pages/experiments/arm/use/progress", params={"job": "a1"}, headers=HTML)

    return follow


def test_a_page_follows_a_job_until_its_end_and_is_then_drawn_afresh(followed, service):
    for state in (JobState.QUEUED, JobState.RUNNING):
        answer = followed(state)
        assert "<strong>Predicting motion</strong>" in answer.text
        assert "/pages/experiments/arm/use/progress?job=a1" in answer.text
        assert "hx-refresh" not in answer.headers
    assert followed(JobState.DONE).headers["hx-refresh"] == "true"
    for state, tone in ((JobState.CANCELLED, "warn"), (JobState.FAILED, "fault"), (JobState.LOST, "fault")):
        answer = followed(state)
        assert f'class="message {tone} problem"' in answer.text
        assert "The motion was not predicted: half way." in answer.text
        assert "hx-refresh" not in answer.headers
    viewer = service.client(Role.VIEWER)
    unknown = viewer.get("/pages/experiments/arm/use/progress", params={"job": "b2"}, headers=HTML)
    assert unknown.status_code == 404
    assert "no longer known; start it again" in unknown.text
