"""Files that other people made are read in a process that may fail, hang or run out of memory without the service.

Weighed and turned down: `pebble`, whose pool ends processes that take too long, but knows nothing of memory, processor time
and descriptors, and starts its workers anew at 1.5 s each where ours are forked in 20 ms from the server that jobs use.
"""

import logging
import threading
from typing import Any

from api.service.job_process import JobProcess
from api.service.problems import Problem
from api.service.process_limits import LimitExceeded, ProcessLimits
from identify.recording.errors import InputError

PATIENCE = 10.0
"""s that a request waits for others to be done reading: each that waits has a thread of the service."""
_log = logging.getLogger(__name__)


class ConfinedReader:
    """Reads in processes of their own.

    limits       : of each
    simultaneous : processes at the same time; who comes later waits
    """

    def __init__(self, limits: ProcessLimits, simultaneous: int = 2) -> None:
        self.limits = limits
        self._free = threading.BoundedSemaphore(simultaneous)

    def __call__(self, function: str, **arguments: object) -> Any:
        """What `function` (`module:name`, called as a job is) returns.

        Raises InputError (the input is wrong, or it made the reader die or fail), LimitExceeded, and the problems 503 (no
        process is free, or none can be started) and whatever the function raises.
        """
        if not self._free.acquire(timeout=min(PATIENCE, self.limits.seconds)):
            raise Problem(503, "Other files are being read; try again.", {"Retry-After": "10"})
        try:
            kind, content = self._read(function, arguments)
        finally:
            self._free.release()
        if kind == "result":
            return content
        if kind == "wrong":
            raise InputError(content)
        if kind == "refused":
            raise Problem(*content)
        if kind == "exceeded":
            raise LimitExceeded(content)
        _log.warning("%s %s: %s", function, kind, content)
        raise InputError(f"cannot be read ({content})")

    def _read(self, function: str, arguments: dict[str, object]) -> tuple[str, Any]:
        try:
            process = JobProcess(function, arguments, self.limits)
        except OSError as error:
            detail = f"This computer can start no process to read files now ({error.strerror}); try again."
            raise Problem(503, detail, {"Retry-After": "10"}) from error
        try:
            while (message := process.message(self.limits.seconds)) is None or message[0] == "progress":
                pass
            return message
        finally:
            process.end()
