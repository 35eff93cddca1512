"""Searches that began by themselves give way to a step of the model."""

from api.service.database import open_database
from api.service.job_documents import JobResult, JobState
from api.service.jobs import JobRunner
from api.service.searches_aside import set_searches_aside

ARM = "rx130l-joint3"


def test_a_step_sets_searches_aside_and_nothing_else(tmp_path, monkeypatch):
    """The worker begins once they are cancelled: none of them is ever begun with."""
    database = open_database(tmp_path, None)
    jobs = JobRunner(database, clock=iter(range(100)).__next__)

    def submit(kind: str, experiment: str = ARM) -> str:
        return jobs.submit(
            kind, "module:name", dict, lambda _: JobResult(), user="ada", experiment=experiment
        ).id

    searches = [submit(kind) for kind in ("diagnose", "separate", "refit")]
    cancel = jobs.cancel_kinds
    cancelled = []

    def cancel_and_begin(experiment, kinds):
        cancelled.append((experiment, set(kinds)))
        cancel(experiment, kinds)
        jobs.start()

    monkeypatch.setattr(jobs, "cancel_kinds", cancel_and_begin)
    set_searches_aside(jobs, ARM)
    ended = [jobs.get(each) for each in searches]
    assert [job.state for job in ended if job is not None] == [JobState.CANCELLED] * 3
    assert cancelled == [(ARM, {"diagnose", "separate", "refit"})]
    assert not jobs._listeners
    jobs.close()
    database.close()
