"""Homing through the service: one joint of a rig at a time looks for its home, each started by an operator.

The drive moves the axis by itself and stops by itself when it no longer hears us (`daq.homing`), so that a service that
dies leaves no axis moving.
"""

import logging
import threading
from dataclasses import dataclass
from typing import Any

from api.service.accounts import User
from api.service.audit import AuditLog
from api.service.payload_sessions import PayloadSessions
from api.service.problems import Problem
from api.service.rig_store import RigStore
from daq.rig import Rig
from drivers.errors import DriverError

HOMING, DONE, STOPPED, FAILED = "homing", "done", "stopped", "failed"
"""States of a homing."""
PATIENCE = 30.0
"""s that the service, at its end, waits for an axis to be at rest and without power."""
_log = logging.getLogger(__name__)


@dataclass
class HomingRun:
    """One joint's homing, under way or the last one.

    words    : for the operator: what was found, or why it ended
    position : rad or m, where the joint stands by the rig file's `home`; None unless done
    """

    rig: str
    joint: str
    method: int | None
    operator: str
    state: str = HOMING
    words: str = ""
    position: float | None = None
    within_limits: bool | None = None


class Homings:
    """Starts homings, follows them, stops them."""

    def __init__(self, rigs: RigStore, sessions: PayloadSessions, audit: AuditLog) -> None:
        self._rigs = rigs
        self._sessions = sessions
        self._audit = audit
        self._runs: dict[str, HomingRun] = {}
        self._stops: dict[str, threading.Event] = {}
        self._threads: dict[str, threading.Thread] = {}
        sessions.homing = self.moving

    def run(self, rig: str) -> HomingRun | None:
        """The homing under way on a rig, or the last one."""
        return self._runs.get(rig)

    def under_way(self) -> HomingRun | None:
        """A joint that looks for its home, on whichever rig."""
        return next((run for run in list(self._runs.values()) if run.state == HOMING), None)

    def moving(self, rig: str) -> bool:
        """Whether a joint of the rig looks for its home."""
        run = self._runs.get(rig)
        return run is not None and run.state == HOMING

    def start(
        self,
        rig: str,
        user: User,
        *,
        joint: str,
        method: int | None = None,
        reset_faults: bool = False,
        client: str = "",
    ) -> HomingRun:
        """Let a joint's drive look for its home. Returns at once.

        Raises the problem 409 while somebody else has the rig, or a session or another homing its bus, and InputError for
        a joint that the rig has not, or a rig whose drives live only as long as a session.
        """
        from daq.homing import joints_to_home, require_lasting_drives

        settings = self._rigs.rig(rig)
        (index,) = joints_to_home(settings, (joint,))
        require_lasting_drives(settings)
        self._rigs.require(rig, user)
        with self._sessions.without_session(rig):
            if self.moving(rig):
                raise Problem(409, f"{self._runs[rig].joint} looks for its home; wait for it, or stop it.")
            # Written before anything moves: without a log there is no motion.
            self._audit.append(user, "homing start", f"rig {rig}, joint {joint}", "asked", client=client)
            run = HomingRun(rig, joint, method, user.name)
            stop = threading.Event()
            thread = threading.Thread(
                target=self._home, args=(run, settings, index, reset_faults, stop), name=f"homing-{rig}"
            )
            self._runs[rig], self._stops[rig], self._threads[rig] = run, stop, thread
            thread.start()
        return run

    def stop(self, rig: str, reason: str) -> bool:
        """Bring the joint that looks for its home to rest; whether there was one. Harmless when repeated."""
        run = self._runs.get(rig)
        if run is None or run.state != HOMING:
            return False
        run.words = run.words or reason
        self._stops[rig].set()
        return True

    def stop_all(self, reason: str) -> None:
        """Bring every joint to rest."""
        for rig in list(self._runs):
            self.stop(rig, reason)

    def close(self) -> None:
        """Stop everything, and wait until it is at rest."""
        self.stop_all("the service ended")
        for thread in list(self._threads.values()):
            thread.join(PATIENCE)

    def _home(
        self, run: HomingRun, settings: Rig, index: int, reset_faults: bool, stop: threading.Event
    ) -> None:
        """In a thread of its own, from the bus taken to the bus given back."""
        state, found = FAILED, None
        try:
            found = self._with_the_bus(settings, index, run.method, reset_faults, stop)
            state = DONE
        except DriverError as error:
            state = STOPPED if stop.is_set() else FAILED
            run.words = run.words or str(error)
        except Exception as error:
            _log.exception("homing %s of %s", run.joint, run.rig)
            run.words = run.words or f"{type(error).__name__}: {error}"
        if found is not None:
            run.words, run.position, run.within_limits = found.words, found.position, found.within_limits
        run.state = state

    def _with_the_bus(
        self, settings: Rig, index: int, method: int | None, reset_faults: bool, stop: threading.Event
    ) -> Any:
        from daq.homing import Homing

        with Homing(settings, stop) as homing:
            if reset_faults:
                homing.reset_faults()
            return homing.home(index, method)
