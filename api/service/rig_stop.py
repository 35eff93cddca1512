"""The stop of a rig: whatever moves it, a session or a homing, comes to rest."""

import threading

import anyio
import anyio.to_thread

from api.service.accounts import User
from api.service.homings import Homings
from api.service.payload_sessions import PayloadSessions

STOP_THREADS = 4
"""Threads that only ever stop a rig."""


class RigStop:
    """Stops rigs in threads of its own, so that no slow request is ahead of it."""

    def __init__(self, sessions: PayloadSessions, homings: Homings) -> None:
        self._sessions = sessions
        self._homings = homings
        self._threads: anyio.CapacityLimiter | None = None

    async def stop(self, rig: str, user: User) -> bool:
        """Bring the rig to rest, now; returns whether anything was under way. Harmless when repeated."""
        if self._threads is None:  # made in the event loop that it belongs to
            self._threads = anyio.CapacityLimiter(STOP_THREADS)

        def stop_both() -> bool:
            homing = self._homings.stop(rig, f"stopped by {user.name}")
            return self._sessions.stop(rig, user) or homing

        return await anyio.to_thread.run_sync(stop_both, limiter=self._threads)

    def stop_all(self, reason: str) -> None:
        """Bring every rig to rest, from a signal's handler too; returns at once."""
        for owner in (self._homings, self._sessions):
            threading.Thread(target=owner.stop_all, args=(reason,)).start()
