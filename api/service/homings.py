"""Homing through the service: one joint of a rig at a time, each started by an operator.

The drive moves the axis by itself and stops by itself when it no longer hears us (`daq.homing`), so that a service that
dies leaves no axis moving.
"""

import logging
import threading
import time
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

from api.service.accounts import User
from api.service.audit import AuditLog
from api.service.bus_claims import BusClaim, BusClaims
from api.service.rig_operators import RigOperators
from api.service.rig_store import RigStore
from daq.rig import Rig
from drivers.errors import DriverError

HOMING, DONE, STOPPED, FAILED = "homing", "done", "stopped", "failed"
"""States of a homing."""
DEAF = 2.0
"""s without a stop that could be answered, after which a homing ends by itself, as a session does"""
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

    @property
    def moves(self) -> bool:
        """Whether it is under way."""
        return self.state == HOMING

    @property
    def refusal(self) -> str:
        """For somebody else who wants the bus."""
        return f"Joint {self.joint} is being homed; wait for it, or stop it."


class HomingStop(threading.Event):
    """Set by whoever stops a homing, and by itself once no stop could have been heard for `DEAF` s.

    words : why it set itself; empty where a person did
    """

    def __init__(self, could_stop_now: Callable[[], bool]) -> None:
        super().__init__()
        self._could_stop_now = could_stop_now
        self._heard = time.monotonic()
        self.words = ""

    def is_set(self) -> bool:
        """Whether the axis is to come to rest; asked in every turn of the homing."""
        if not super().is_set():
            now = time.monotonic()
            if self._could_stop_now():
                self._heard = now
            elif now - self._heard > DEAF:
                self.words = f"the service could not have answered the stop button for {DEAF:g} s; it stopped the homing itself"
                self.set()
        return super().is_set()


class Homings:
    """Starts homings, follows them, stops them."""

    def __init__(
        self,
        rigs: RigStore,
        operators: RigOperators,
        claims: BusClaims,
        audit: AuditLog,
        could_stop_now: Callable[[], bool] = lambda: True,
    ) -> None:
        self._could_stop_now = could_stop_now
        self._rigs = rigs
        self._operators = operators
        self._claims = claims
        self._audit = audit
        self._runs: dict[str, HomingRun] = {}
        self._stops: dict[str, HomingStop] = {}
        self._threads: dict[str, threading.Thread] = {}

    def run(self, rig: str) -> HomingRun | None:
        """The homing under way on a rig, or the last one."""
        return self._runs.get(rig)

    def under_way(self) -> HomingRun | None:
        """A homing that moves a joint now, on whichever rig."""
        return next((run for run in list(self._runs.values()) if run.moves), None)

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
        """Let a joint's drive home it. Returns at once.

        Raises the problem 409 while somebody else has the rig, or a session or another homing its bus, and InputError for
        a joint that the rig has not, or a rig whose drives live only as long as a session.
        """
        from daq.homing import joints_to_home, require_lasting_drives

        settings = self._rigs.rig(rig)
        (index,) = joints_to_home(settings, (joint,))
        require_lasting_drives(settings)
        self._operators.take(rig, user)
        run = HomingRun(rig, joint, method, user.name)
        claim = self._claims.claim(rig, settings.bus, run)
        try:
            # Written before anything moves: without a log there is no motion.
            self._audit.append(user, "homing start", f"rig {rig}, joint {joint}", "asked", client=client)
            stop = HomingStop(self._could_stop_now)
            thread = threading.Thread(
                target=self._home,
                args=(run, claim, settings, index, reset_faults, stop),
                name=f"homing-{rig}",
            )
            self._runs[rig], self._stops[rig], self._threads[rig] = run, stop, thread
            thread.start()
        except BaseException:
            claim.release()
            raise
        return run

    def rigs(self) -> list[str]:
        """Rigs on which something was homed since the service began."""
        return list(self._runs)

    def stop(self, rig: str, reason: str) -> bool | None:
        """Bring the joint that is being homed to rest; whether there was one, None if there never was. Harmless when repeated."""
        run = self._runs.get(rig)
        if run is None:
            return None
        if not run.moves:
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
        self,
        run: HomingRun,
        claim: BusClaim,
        settings: Rig,
        index: int,
        reset_faults: bool,
        stop: "HomingStop",
    ) -> None:
        """In a thread of its own, from the bus taken to the bus given back."""
        state, homed = FAILED, None
        try:
            homed = self._with_the_bus(settings, index, run.method, reset_faults, stop)
            state = DONE
        except DriverError as error:
            state = STOPPED if stop.is_set() else FAILED
            run.words = run.words or stop.words or str(error)
        except Exception as error:
            _log.exception("homing %s of %s", run.joint, run.rig)
            run.words = run.words or f"{type(error).__name__}: {error}"
        if homed is not None:
            run.words, run.position, run.within_limits = homed.words, homed.position, homed.within_limits
        claim.release()  # first: who sees that it has ended may claim the bus at once
        run.state = state

    def _with_the_bus(
        self, settings: Rig, index: int, method: int | None, reset_faults: bool, stop: threading.Event
    ) -> Any:
        from daq.homing import Homing

        with Homing(settings, stop) as homing:
            if reset_faults:
                homing.reset_faults()
            return homing.home(index, method)
