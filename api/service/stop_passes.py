"""Who may stop: everybody who was let in since the service began, known without a database.

Stopping is safe, so it is believed generously: a token that was revoked, a sign-in that ended or the operator at the
machine itself after somebody made the first account may no longer begin anything, but may still stop what moves. What is
believed is kept in memory; the service tells it of every sign-in and token that it makes or sees, and a thread reads those
that other programs (`coulomb users`) made.
"""

import logging
import threading
from collections.abc import Callable

from api.service.accounts import User, digest

READ_EVERY = 2.0
"""s between two looks at what other programs made"""
_log = logging.getLogger(__name__)


class StopPasses:
    """Digests of sign-ins and tokens, and whose they are; only added to."""

    def __init__(self) -> None:
        self._owners: dict[str, User] = {}
        self.local_operator = False
        """whether the operator at the machine itself, without an account, was ever let in"""
        self._ended = threading.Event()
        self._thread: threading.Thread | None = None

    def remember(self, secret: str, user: User) -> None:
        """Somebody is let in by this secret."""
        self._owners[digest(secret)] = user

    def owner(self, secret: str) -> User | None:
        """Whose sign-in or token this is, or was; None if nobody was let in by it."""
        return self._owners.get(digest(secret))

    def keep_up_to_date(self, read: Callable[[], dict[str, User]]) -> None:
        """Add what `read()` finds, now and again until `end`; a database that does not answer holds up nobody but this."""
        self._thread = threading.Thread(target=self._keep, args=(read,), name="stop-passes", daemon=True)
        self._thread.start()

    def end(self) -> None:
        """Read no more."""
        self._ended.set()

    def _keep(self, read: Callable[[], dict[str, User]]) -> None:
        while True:
            try:
                self._owners |= read()
            except Exception as error:
                _log.debug("tokens and sign-ins could not be read for the stop: %s", error)
            if self._ended.wait(READ_EVERY):
                return
