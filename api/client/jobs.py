"""Jobs of the service: followed, waited for, cancelled."""

import time as clock
from collections.abc import Callable, Iterator

from api.client.connection import Connection
from identify.results.document import Json

FINAL = frozenset({"done", "failed", "cancelled", "lost"})


class JobFailed(Exception):
    """A job ended otherwise than done; `job` is its last state."""

    def __init__(self, job: Json) -> None:
        super().__init__(f"{job['kind']}: {job['state']}: {job['words']}")
        self.job = job


class JobCalls(Connection):
    """What a client can ask about jobs."""

    def job(self, identifier: str) -> Json:
        """A job as it is now."""
        return self._get(f"/jobs/{identifier}")

    def cancel(self, identifier: str) -> Json:
        """Cancel a job."""
        return self._post(f"/jobs/{identifier}/cancel")

    def wait(
        self, job: Json, progress: Callable[[float, str], None] | None = None, pause: float = 0.2
    ) -> Json:
        """Wait for a job's end and return its last state; `progress(fraction, words)` is called on the way.

        Raises JobFailed if it ends otherwise than done.
        """
        for state in self.follow(job, pause):
            job = state
            if progress is not None:
                progress(job["fraction"], job["words"])
        if job["state"] != "done":
            raise JobFailed(job)
        return job

    def follow(self, job: Json, pause: float = 0.2) -> Iterator[Json]:
        """Every state of a job that differs from the one before, asked for every `pause` s; ends with the
        last.
        """
        seen: Json = {}
        while True:
            state = self.job(job["id"])
            if state != seen:
                yield state
            if state["state"] in FINAL:
                return
            seen = state
            clock.sleep(pause)
