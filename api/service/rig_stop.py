"""The stop of a rig: whatever moves it, a session or a homing, comes to rest.

Nothing here needs a database, a file, a lock or a new thread, and nothing waits: a stop is an order to a process or a
thread that is there already.
"""

import threading

from api.service.homings import Homings
from api.service.payload_sessions import PayloadSessions


class RigStop:
    """Stops rigs; from any thread, harmless when repeated."""

    def __init__(self, sessions: PayloadSessions, homings: Homings) -> None:
        self._sessions = sessions
        self._homings = homings

    def stop(self, rig: str, name: str) -> bool | None:
        """Bring the rig to rest, now, for the person of that name.

        Returns whether anything was under way, None for a rig that nothing has used since the service began.
        """
        stopped = [self._homings.stop(rig, f"stopped by {name}"), self._sessions.stop(rig, name)]
        known = [each for each in stopped if each is not None]
        return any(known) if known else None

    def stop_session(self, experiment: str, session: str, name: str) -> bool | None:
        """Bring the rig of this session to rest; None where no rig has it."""
        rig = self._sessions.rig_of(experiment, session)
        return None if rig is None else self.stop(rig, name)

    def stop_everything(self, name: str) -> list[str]:
        """Bring every rig to rest, for the person of that name; ids of those that moved."""
        rigs = sorted({*self._sessions.rigs(), *self._homings.rigs()})
        return [rig for rig in rigs if self.stop(rig, name)]

    def stop_all(self, reason: str) -> None:
        """Bring every rig to rest, from a signal's handler too; returns at once."""
        for owner in (self._homings, self._sessions):
            threading.Thread(target=owner.stop_all, args=(reason,)).start()
