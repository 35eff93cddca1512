"""The audit rows of stops: written after the stop, as soon as the database takes them.

A stop waits for nothing. What it was is kept in memory with its time and written by a thread of its own, again and again
until it is in the log.
"""

import logging
import queue
import threading
import time
from collections.abc import Callable

from api.service.accounts import User
from api.service.audit import AuditLog

RETRY_EVERY = 1.0
"""s between attempts while the database is locked or the disk is full"""
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
        self._waiting = 0
        self._ended = threading.Event()
        # Started with the service: a stop may come when no thread can be had.
        self._thread = threading.Thread(target=self._write, name="stop-log", daemon=True)
        self._thread.start()

    def append(self, user: User, action: str, target: str, outcome: str, client: str) -> None:
        """Write a row with the time of now, later; returns at once."""
        at = self._clock()
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
            while not self._ended.is_set():
                try:
                    row()
                    break
                except Exception as error:
                    _log.warning("a stop is not in the audit log yet, tried again: %s", error)
                    self._ended.wait(RETRY_EVERY)
            self._waiting -= 1
