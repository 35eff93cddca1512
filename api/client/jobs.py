"""Jobs of the service: followed, waited for, cancelled."""

import time as clock
from collections.abc import Callable, Iterator

from api.client.connection import Connection
from api.service.job_documents import JobState, JobView


class JobFailed(Exception):
    """A job ended otherwise than done; `job` is its last state."""

    def __init__(self, job: JobView) -> None:
        super().__init__(f"{job.kind}: {job.state}: {job.words}")
        self.job = job


class JobCalls(Connection):
    """What a client can ask about jobs."""

    def jobs(self, experiment: str | None = None) -> list[JobView]:
        """The newest jobs first, of one experiment or of all."""
        query = {"experiment": experiment} if experiment else {}
        return self._all(JobView, "/jobs", **query)

    def job(self, identifier: str) -> JobView:
        """A job as it is now."""
        return self._one(JobView, f"/jobs/{identifier}")

    def cancel(self, identifier: str) -> JobView:
        """Cancel a job."""
        return self._begin(f"/jobs/{identifier}/cancel")

    def wait(
        self, job: JobView | str, progress: Callable[[float, str], None] | None = None, pause: float = 0.2
    ) -> JobView:
        """Wait for the end of a job, or of that with an id, and return its last state; `progress(fraction, words)` is called on
        the way.

        Raises JobFailed if it ends otherwise than done.
        """
        states = self.follow(job, pause)
        state = next(states)
        while True:
            if progress is not None:
                progress(state.fraction, state.words)
            if not state.state.final:
                state = next(states)
            elif state.state is JobState.DONE:
                return state
            else:
                raise JobFailed(state)

    def follow(self, job: JobView | str, pause: float = 0.2) -> Iterator[JobView]:
        """Every state of a job that differs from the one before, asked for every `pause` s; ends with the
        last.
        """
        identifier = job if isinstance(job, str) else job.id
        seen = None
        while True:
            state = self.job(identifier)
            if state != seen:
                yield state
            if state.state.final:
                return
            seen = state
            clock.sleep(pause)
