"""The steps of the model from the page: what each does, what it sets aside, and what a page is told meanwhile."""

import pytest

from api.service.accounts import Role
from api.service.job_documents import JobState
from api.service.jobs import Job

ARM = "rx130l-joint3"
EXPERIMENT = f"/pages/experiments/{ARM}"


def job(kind: str, state: JobState = JobState.RUNNING) -> Job:
    return Job("a1", kind, ARM, "ada", state, 0.5, "half way", 0.0)


@pytest.fixture
def page(laboratory):
    client = laboratory.client(Role.OPERATOR)
    client.headers["Accept"] = "text/html"
    return client


@pytest.fixture
def computed(laboratory, monkeypatch):
    """Says which jobs are under way."""

    def under_way(*jobs: Job) -> None:
        unfinished = [each for each in jobs if not each.state.final]
        held = laboratory.service.jobs
        monkeypatch.setattr(held, "unfinished", lambda _: unfinished)
        monkeypatch.setattr(held, "active", lambda _: next(iter(unfinished), None))
        monkeypatch.setattr(held, "get", {each.id: each for each in jobs}.get)

    return under_way


@pytest.fixture
def asked(laboratory, monkeypatch):
    """What the models are asked to compute: nothing is."""
    calls = []

    def record(name):
        monkeypatch.setattr(
            laboratory.service.models,
            name,
            lambda *given, **named: calls.append((name, *given[2:], *named.items())),
        )

    for name in ("diagnose", "refit", "add_effect", "add_learned", "remove_effect", "fit_earlier_again"):
        record(name)
    return calls


def test_undo_and_redo_answer_with_the_model_that_then_stands(laboratory, page):
    def line():
        return laboratory.service.models.story(ARM).read().line

    undone = page.post(f"{EXPERIMENT}/steps/undo")
    assert (undone.status_code, line()) == (200, ["m1"])
    assert 'data-candidate="load-friction-asymmetric"' in undone.text
    redone = page.post(f"{EXPERIMENT}/steps/redo?joint=j3")
    assert (redone.status_code, line()) == (200, ["m1", "m2"])
    assert 'data-candidate="load-stribeck"' in redone.text
    assert page.post(f"{EXPERIMENT}/steps/cancel?joint=j9").status_code == 404


def test_effects_are_added_to_a_joint_and_removed_where_they_are(page, asked):
    for step in ("add?joint=j3&effect=stribeck", "add-learned", "remove?joint=j3&effect=stribeck@j3"):
        assert page.post(f"{EXPERIMENT}/steps/{step}").status_code == 200
    page.post(f"{EXPERIMENT}/steps/remove?joint=j3&effect=stribeck")
    page.post(f"{EXPERIMENT}/steps/fit-earlier")
    assert asked == [
        ("add_effect", "stribeck", "j3", ("set_aside", True)),
        ("add_learned", "j3", ("set_aside", True)),
        ("remove_effect", "stribeck", "j3", ("set_aside", True)),
        ("remove_effect", "stribeck", None, ("set_aside", True)),
        ("fit_earlier_again",),
    ]


@pytest.mark.parametrize(
    ("under_way", "diagnosed", "fitted"),
    [
        ((), True, True),
        (("refit",), True, False),
        (("diagnose",), False, False),
        (("refit", "plan"), False, False),
    ],
)
def test_what_is_computed_already_is_not_asked_for_again(page, computed, asked, under_way, diagnosed, fitted):
    computed(*(job(kind) for kind in under_way))
    assert page.post(f"{EXPERIMENT}/steps/diagnose?motion=true").status_code == 200
    assert asked == [("diagnose", ("motion", True))] * diagnosed
    asked.clear()
    assert page.post(f"{EXPERIMENT}/steps/fit").status_code == 204
    assert asked == [("refit",)] * fitted


def test_a_job_is_followed_until_the_part_of_the_page_comes_with_what_it_found(page, computed):
    address = f"{EXPERIMENT}/steps/progress?job=a1&joint=j3"
    computed(job("diagnose"))
    running = page.get(address)
    assert 'id="cancel-job"' in running.text
    assert "50 % · half way" in running.text
    computed(job("refit"))
    assert "0 earlier versions are being fitted to the same sessions: 50 %" in page.get(address).text
    for kind in ("diagnose", "refit"):
        computed(job(kind, JobState.DONE))
        ended = page.get(address)
        assert (ended.headers["hx-retarget"], ended.headers["hx-reswap"]) == ("#steps-body", "outerHTML")
        assert "half way" not in ended.text
    computed(job("diagnose", JobState.FAILED))
    assert '<div class="message fault" role="alert"><p>half way</p></div>' in page.get(address).text
    assert "hx-retarget" not in running.headers


def test_news_are_a_fresh_page_for_another_fit_and_the_progress_of_what_the_page_waits_for(page, computed):
    def news(seen="m2.f1"):
        return page.get(f"{EXPERIMENT}/news", params={"seen": seen})

    assert news("m1.f1").headers["hx-refresh"] == "true"
    for kind, shown in (("identify", True), ("diagnose", True), ("separate", False), ("refit", False)):
        computed(job(kind))
        answer = news()
        assert "hx-refresh" not in answer.headers
        assert ("half way" in answer.text) == shown
    computed()
    assert "message" not in news().text


STEPS = (
    "diagnose",
    "fit-earlier",
    "add?effect=stribeck",
    "add-learned",
    "remove?effect=stribeck",
    "undo",
    "redo",
    "cancel",
)


@pytest.mark.parametrize("step", STEPS)
def test_a_step_for_a_joint_that_does_not_exist_is_not_done(
    laboratory, page, computed, asked, monkeypatch, step
):
    story = laboratory.service.models.story(ARM)
    before, cancelled = story.read(), []
    for name in ("cancel", "cancel_kinds"):
        monkeypatch.setattr(laboratory.service.jobs, name, lambda *given: cancelled.append(given))
    computed(job("diagnose"))
    answer = page.post(f"{EXPERIMENT}/steps/{step}{'&' if '?' in step else '?'}joint=j9")
    assert answer.status_code == 404
    assert "The robot has no joint j9; it has j3." in answer.text
    assert (asked, cancelled, story.read()) == ([], [], before)


@pytest.mark.parametrize(
    ("step", "status"),
    [
        ("add?joint=j3&effect=nothing", 422),
        ("remove?joint=j3&effect=backlash", 409),
        ("remove?joint=j3&effect=viscous@", 422),
    ],
)
def test_a_step_that_is_refused_cancels_no_search(laboratory, page, computed, monkeypatch, step, status):
    cancelled = []
    monkeypatch.setattr(laboratory.service.jobs, "cancel_kinds", lambda *given: cancelled.append(given))
    computed(job("diagnose"))
    assert page.post(f"{EXPERIMENT}/steps/{step}").status_code == status
    computed(job("improve"))
    assert page.post(f"{EXPERIMENT}/steps/undo").status_code == 409
    assert cancelled == []


def test_undo_leaves_what_stands_where_the_files_of_the_model_before_are_gone(laboratory, page):
    story = laboratory.service.models.story(ARM)
    folder = story.fit_folder("m1").parent
    folder.rename(folder.with_name("put aside"))
    try:
        answer = page.post(f"{EXPERIMENT}/steps/undo")
        assert answer.status_code == 404
        assert (
            "models/m1/f1/identification.json of model m1 is gone; put it back from a backup." in answer.text
        )
        assert story.read().line == ["m1", "m2"]
    finally:
        folder.with_name("put aside").rename(folder)
