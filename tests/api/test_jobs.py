"""Jobs: real processes, progress, cancel, failure, restart."""

import os
import threading

import pytest

from api.service.database import open_database
from api.service.job_documents import JobResult
from api.service.jobs import MOST, MOST_OF_A_USER, Job, JobRunner, JobState
from api.service.problems import Problem
from api.service.process_limits import GIBIBYTE, MEBIBYTE, ProcessLimits

WORK = """
import os, signal
from identify.recording.errors import InputError

def double(progress, value):
    for step in range(5):
        progress(step / 5, f"step {step}")
    return {"value": 2 * value, "process": os.getpid()}

def wait_for_cancel(progress, began):
    open(began, "w").close()
    while True:
        progress(0.5, "waiting")

def deaf(progress, began):
    progress(0.1, "deaf from now on")
    open(began, "w").close()
    signal.pause()

def large(progress, began):
    return len(bytearray(1 << 30))

def killed(progress):
    os.kill(os.getpid(), signal.SIGKILL)

def wrong(progress):
    raise InputError("session-00.csv line 7: not a number")

def broken(progress):
    return 1 / 0
"""


@pytest.fixture
def work(tmp_path, monkeypatch):
    """A module of computations that the processes can import."""
    (tmp_path / "work_of_these_tests.py").write_text(WORK)
    monkeypatch.syspath_prepend(str(tmp_path))
    return "work_of_these_tests"


@pytest.fixture
def database(tmp_path):
    opened = open_database(tmp_path, None)
    yield opened
    opened.close()


def ended(runner: JobRunner, job: Job) -> bool:
    known = runner.get(job.id)
    return known is not None and known.state.final


class Follower:
    """Keeps every snapshot of a job and waits for the last."""

    def __init__(self, runner):
        self.snapshots = []
        self._ended = threading.Event()
        self._running = threading.Event()
        runner.listen(self._changed)

    def _changed(self, job):
        self.snapshots.append(job)
        if job.words not in ("starting", "waiting for its turn"):
            self._running.set()
        if job.state.final:
            self._ended.set()

    def last(self):
        assert self._ended.wait(50)
        return self.snapshots[-1]

    def began(self):
        assert self._running.wait(50)


@pytest.fixture
def runner(database, clock):
    running = JobRunner(database, clock)
    running.start()
    yield running
    running.close()


def submit(runner, function, store=lambda _result: JobResult(), experiment="arm", **arguments):
    return runner.submit("test", function, lambda: arguments, store, user="ada", experiment=experiment)


def test_a_job_reports_its_progress_computes_in_another_process_and_stores_before_it_is_done(runner, work):
    follower, stored = Follower(runner), []

    def store(result):
        stored.append((result, follower.snapshots[-1].state))
        return JobResult(plan=str(result["value"]))

    job = submit(runner, f"{work}:double", store, value=21)
    assert job.state is JobState.QUEUED
    last = follower.last()
    assert last.state is JobState.DONE
    assert last.result == JobResult(plan="42")
    assert stored[0][0]["process"] != os.getpid()
    assert stored[0][1] is JobState.RUNNING
    fractions = [snapshot.fraction for snapshot in follower.snapshots]
    assert fractions == sorted(fractions)
    assert "step 3" in {snapshot.words for snapshot in follower.snapshots}


@pytest.mark.parametrize("function", ["wait_for_cancel", "deaf"])
def test_a_job_is_cancelled_whether_it_listens_or_not(runner, work, tmp_path, function):
    follower = Follower(runner)
    job = submit(runner, f"{work}:{function}", began=str(tmp_path / "began"))
    follower.began()
    runner.cancel(job.id)
    assert follower.last().state is JobState.CANCELLED
    with pytest.raises(Problem, match="ended already"):
        runner.cancel(job.id)


def test_a_queued_job_is_cancelled_before_it_begins(runner, work, tmp_path):
    first_follower = Follower(runner)
    first = submit(runner, f"{work}:wait_for_cancel", began=str(tmp_path / "began"))
    second = submit(runner, f"{work}:double", value=1)
    first_follower.began()
    runner.cancel(second.id)
    runner.cancel(first.id)
    first_follower.last()
    runner.close()
    assert runner.get(second.id).state is JobState.CANCELLED


@pytest.mark.parametrize(
    ("function", "words"),
    [
        ("killed", "the process was ended by SIGKILL"),
        ("wrong", "session-00.csv line 7: not a number"),
        ("broken", "ZeroDivisionError: division by zero"),
        ("missing", "AttributeError"),
    ],
)
def test_a_computation_that_fails_or_dies_says_why_and_the_next_job_runs(runner, work, function, words):
    follower = Follower(runner)
    submit(runner, f"{work}:{function}")
    last = follower.last()
    assert last.state is JobState.FAILED
    assert words in last.words
    second = Follower(runner)
    submit(runner, f"{work}:double", value=1)
    assert second.last().state is JobState.DONE


def test_a_result_that_cannot_be_stored_is_a_failed_job(runner, work):
    def full(_result):
        raise OSError(28, "No space left on device")

    follower = Follower(runner)
    submit(runner, f"{work}:double", full, value=1)
    assert follower.last().state is JobState.FAILED
    assert "No space left" in follower.last().words


def test_a_job_that_a_restart_interrupted_is_lost_and_its_id_stays_good(database, clock, work):
    never_started = JobRunner(database, clock)
    job = submit(never_started, f"{work}:double", value=1)
    after = JobRunner(database, clock).get(job.id)
    assert after is not None
    assert after.state is JobState.LOST
    assert "restarted" in after.words


def test_jobs_of_one_experiment_come_one_after_the_other(database, clock, work):
    runner = JobRunner(database, clock, simultaneous=2)
    runner.start()
    follower = Follower(runner)
    jobs = [submit(runner, f"{work}:double", value=number) for number in range(4)]
    for job in jobs:
        while not ended(runner, job):
            follower._ended.wait(0.05)
    runner.close()
    running = []
    for snapshot in follower.snapshots:
        if snapshot.state is JobState.RUNNING and snapshot.id not in running:
            running.append(snapshot.id)
        if snapshot.state.final:
            running.remove(snapshot.id)
        assert len(running) <= 1


def test_one_person_and_all_together_have_a_bounded_number_of_jobs(database, clock, work):
    runner = JobRunner(database, clock)  # never started: all wait
    for number in range(MOST_OF_A_USER):
        submit(runner, f"{work}:double", experiment=f"arm-{number}", value=1)
    with pytest.raises(Problem, match="ada has 10 jobs") as refused:
        submit(runner, f"{work}:double", value=1)
    assert refused.value.status == 429
    for number in range(MOST - MOST_OF_A_USER):
        runner.submit(
            "test", f"{work}:double", dict, lambda _: JobResult(), user=f"user-{number}", experiment="other"
        )
    with pytest.raises(Problem, match="100 jobs"):
        runner.submit("test", f"{work}:double", dict, lambda _: JobResult(), user="grace", experiment="other")


def test_people_who_ask_at_the_same_time_get_no_more_jobs_than_may_be(database, clock, work):
    runner = JobRunner(database, clock)
    together, refused = threading.Barrier(20), []

    def ask(number):
        together.wait()
        try:
            submit(runner, f"{work}:double", experiment=f"arm-{number}", value=1)
        except Problem:
            refused.append(number)

    asking = [threading.Thread(target=ask, args=(number,)) for number in range(20)]
    for each in asking:
        each.start()
    for each in asking:
        each.join()
    assert len(runner.jobs()) == MOST_OF_A_USER
    assert len(refused) == 20 - MOST_OF_A_USER


def test_what_follows_by_itself_waits_once_for_all_changes_and_is_never_refused(database, clock, work):
    runner = JobRunner(database, clock)
    for number in range(MOST_OF_A_USER):
        submit(runner, f"{work}:double", experiment=f"arm-{number}", value=1)
    repeats = [
        runner.submit(
            "identify", "f", dict, lambda _: JobResult(), user="ada", experiment="arm-1", repeated=True
        )
        for _ in range(3)
    ]
    assert len({each.id for each in repeats}) == 1
    assert len(runner.jobs()) == MOST_OF_A_USER + 1


def test_what_a_person_asks_for_twice_is_one_job_until_it_has_ended(database, clock):
    runner = JobRunner(database, clock)

    def ask(asked, user="ada", experiment="arm"):
        return runner.submit(
            "test", "f", dict, lambda _: JobResult(), user=user, experiment=experiment, asked=asked
        ).id

    first = ask("share 0.6")
    assert ask("share 0.6") == first
    others = [
        ask("share 0.5"),
        ask("share 0.6", "grace"),
        ask("share 0.6", experiment="leg"),
        ask(None),
        ask(None),
    ]
    assert len({first, *others}) == 6
    runner.cancel(first)
    assert ask("share 0.6") not in {first, *others}


@pytest.mark.parametrize(
    ("function", "limits", "words"),
    [
        ("wait_for_cancel", ProcessLimits(GIBIBYTE, 1.0), "not done within 1 s"),
        ("large", ProcessLimits(64 * MEBIBYTE, 60.0), "more than 0.0625 GB of memory"),
    ],
)
def test_a_job_ends_at_its_limits_in_words(database, clock, work, tmp_path, function, limits, words):
    runner = JobRunner(database, clock, limits=limits)
    runner.start()
    follower = Follower(runner)
    submit(runner, f"{work}:{function}", began=str(tmp_path / "began"))
    assert follower.last().state is JobState.FAILED
    assert words in follower.last().words
    runner.close()


def test_what_a_job_was_about_and_why_it_failed_outlive_a_restart(database, clock, work):
    with_formats = [("wrong", "c"), ("wrong", "fmu"), ("double", "fmu")]
    jobs = JobRunner(database, clock)
    jobs.start()
    for function, form in with_formats:
        about = JobResult(model="m1", format=form)
        follower = Follower(jobs)
        jobs.submit(
            "export",
            f"{work}:{function}",
            lambda function=function: {"value": 1} if function == "double" else {},
            lambda _, about=about: about,
            user="ada",
            experiment="arm",
            about=about,
        )
        follower.last()
        clock.advance(1.0)
    jobs.close()
    faults = JobRunner(database, clock).faults("arm", "export", "m1")
    assert faults == {JobResult(format="c"): "session-00.csv line 7: not a number"}
    assert JobRunner(database, clock).faults("arm", "export", "m2") == {}
