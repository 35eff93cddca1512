"""A step of the model does not wait for the searches that begin by themselves: they are cancelled, and begun again after it."""

import threading

from api.service.jobs import Job, JobRunner

FIT_AGAIN = "refit"
"""Kind of the jobs that fit earlier versions again, so that errors of versions are of the same data."""
SEARCHES = ("diagnose", "separate", FIT_AGAIN)
"""Kinds of jobs that give way to a change of the data or the model, and are begun again after it."""
CANCEL_TIMEOUT = 10.0
"""s to wait for a cancelled search; it is ended after two."""


def set_searches_aside(jobs: JobRunner, experiment: str) -> None:
    """Cancel the searches of an experiment (for what is missing, for the next experiment) and the fitting of its earlier
    versions, and wait until they have ended."""
    over = threading.Event()

    def searching() -> bool:
        return any(job.kind in SEARCHES for job in jobs.unfinished(experiment))

    def watch(job: Job) -> None:
        if job.experiment == experiment and job.state.final and not searching():
            over.set()

    jobs.listen(watch)
    try:
        jobs.cancel_kinds(experiment, SEARCHES)
        if searching():
            over.wait(CANCEL_TIMEOUT)
    finally:
        jobs.unlisten(watch)
