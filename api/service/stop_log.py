"""The audit rows of stops: written after the stop, as soon as the database takes them.

A stop waits for nothing. What it was is kept in memory with its time and written by a thread of its own, again and again
until it is in the log. Where the log takes nothing for long and somebody stops thousands of times, the first
`MOST_WAITING` are written one by one, and those after them as one row that counts them.
"""

import logging
import queue
import threading
import time
from collections.abc import Callable
from functools import partial

from api.service.accounts import User
from api.service.audit import AuditLog
from identify.results.document import Json

RETRY_EVERY = 1.0
"""s between attempts while the database is locked or the disk is full"""
MOST_WAITING = 1000
"""rows kept in memory"""
LAST_ATTEMPT = 3.0
"""s that the service, at its end, gives rows that are not written yet"""
READ_PATIENCE = 1.0
"""s that a reader of the log waits for them"""
_log = logging.getLogger(__name__)


class StopLog:
    """Rows on their way into the audit log."""

    def __init__(self, audit: AuditLog, clock: Callable[[], float]) -> None:
        self._audit = audit
        self._clock = clock
        self._rows: queue.SimpleQueue[Callable[[], None] | None] = queue.SimpleQueue()
        self._counting = threading.Lock()  # held for an addition, never while anything is waited for
        self._waiting = 0
        self._more = 0
        self._newest: tuple[User, str, str, str, str, float] | None = None
        self._ended = threading.Event()
        # Started with the service: a stop may come when no thread can be had.
        self._thread = threading.Thread(target=self._write, name="stop-log", daemon=True)
        self._thread.start()

    def append(self, user: User, action: str, target: str, outcome: str, client: str) -> None:
        """Write a row with the time of now, later; returns at once."""
        at = self._clock()
        with self._counting:
            if self._waiting >= MOST_WAITING:
                self._more += 1
                self._newest = (user, action, target, outcome, client, at)
                return
            self._waiting += 1
        self._rows.put(lambda: self._audit.append(user, action, target, outcome, client=client, at=at))

    def settle(self, patience: float = READ_PATIENCE) -> None:
        """Wait until everything asked so far is written, at most `patience` s."""
        latest = time.monotonic() + patience
        while self._waiting and time.monotonic() < latest:
            self._ended.wait(0.01)

    def close(self) -> None:
        """Write what is left, and end."""
        self._rows.put(None)
        self._thread.join(LAST_ATTEMPT)
        self._ended.set()

    def _write(self) -> None:
        while (row := self._rows.get()) is not None:
            self._until_written(row)
            with self._counting:
                self._waiting -= 1
                more, newest = (self._more, self._newest) if not self._waiting else (0, None)
                if newest is not None:
                    # The place of these is taken at once, so that `settle` waits for them too.
                    self._more, self._newest, self._waiting = 0, None, 1
            if newest is not None:
                self._rows.put(partial(self._append_count, more, *newest))

    def _until_written(self, row: Callable[[], None]) -> None:
        while not self._ended.is_set():
            try:
                row()
                return
            except Exception as error:
                _log.warning("a stop is not in the audit log yet, tried again: %s", error)
                self._ended.wait(RETRY_EVERY)

    def _append_count(
        self, more: int, user: User, action: str, target: str, outcome: str, client: str, at: float
    ) -> None:
        """The row of the newest stop beyond those that were kept, with how many there were."""
        details: Json = {
            "stops": more,
            "words": "stops that were too many to be kept one by one; this is the last",
        }
        self._audit.append(user, action, target, outcome, client=client, details=details, at=at)
