"""Who operates a rig, and who watches it.

One operator at a time operates a rig. Stopping it needs nothing but a sign-in.
"""

from collections.abc import Callable
from dataclasses import dataclass, field
from threading import Lock

from api.service.accounts import User
from api.service.bus_claims import BusClaims
from api.service.problems import Problem

FORGOTTEN_AFTER = 15 * 60.0
"""s without a request from its operator after which others may take a rig that rests."""
WATCHES_FOR = 30.0
"""s for which somebody counts as watching after asking for the rig's state."""


@dataclass
class _People:
    """Who is at one rig.

    operator     : name, or None
    tenure       : counts who operated it one after another
    last_request : s since 1970, of the operator
    asked        : name -> s since 1970, when they asked for the rig's state last
    live         : name -> number of live views that are open
    """

    operator: str | None = None
    tenure: int = 0
    last_request: float = 0.0
    asked: dict[str, float] = field(default_factory=dict)
    live: dict[str, int] = field(default_factory=dict)


class RigOperators:
    """Operators and onlookers of all rigs.

    A rig that moves keeps its operator however long they are silent.
    """

    def __init__(self, claims: BusClaims, clock: Callable[[], float]) -> None:
        self._claims = claims
        self._clock = clock
        self._rigs: dict[str, _People] = {}
        self._lock = Lock()

    # --- the operator

    def operator(self, rig: str) -> str | None:
        """Name of the rig's operator, or None."""
        with self._lock:
            return self._current(rig)

    def take(self, rig: str, user: User) -> None:
        """Make the user the rig's operator, as everything that concerns motion does first.

        Raises the problem 409 if somebody else is.
        """
        with self._lock:
            current = self._current(rig)
            if current not in (None, user.name):
                raise Problem(
                    409, f"{current} operates the rig {rig}; ask for it to be released or handed over."
                )
            people = self._people(rig)
            people.tenure += current is None
            people.operator, people.last_request = user.name, self._clock()

    def tenure(self, rig: str) -> int:
        """Which turn of operating this is: another number after every hand-over, release or take."""
        with self._lock:
            return self._people(rig).tenure

    def release(self, rig: str, user: User) -> None:
        """Give the rig back. Raises the problem 409 if the user is not its operator or if it moves."""
        with self._lock:
            people = self._operated_by(rig, user)
            if self._claims.moves(rig):
                raise Problem(409, "A session is armed or running; stop it first.")
            people.operator = None

    def hand_over(self, rig: str, user: User, to: str) -> None:
        """Give the rig to another operator, also during motion. Raises the problem 409 if the user is not its operator."""
        with self._lock:
            people = self._operated_by(rig, user)
            people.tenure += to != people.operator
            people.operator, people.last_request = to, self._clock()

    def _operated_by(self, rig: str, user: User) -> _People:
        current = self._current(rig)
        if current != user.name:
            raise Problem(409, f"{current or 'Nobody'} operates the rig {rig}, not {user.name}.")
        return self._people(rig)

    def _current(self, rig: str) -> str | None:
        people = self._people(rig)
        if people.operator is None or self._claims.moves(rig):
            return people.operator
        if self._clock() - people.last_request > FORGOTTEN_AFTER:
            people.operator = None
        return people.operator

    def _people(self, rig: str) -> _People:
        return self._rigs.setdefault(rig, _People())

    # --- onlookers

    def watch(self, rig: str, user: User) -> None:
        """Note that somebody asked for the rig's state."""
        with self._lock:
            people = self._people(rig)
            people.asked[user.name] = self._clock()
            if people.operator == user.name:
                people.last_request = self._clock()

    def watch_live(self, rig: str, user: User, change: int) -> None:
        """Note that a live view was opened (+1) or closed (-1)."""
        with self._lock:
            live = self._people(rig).live
            live[user.name] = live.get(user.name, 0) + change
            if live[user.name] <= 0:
                del live[user.name]

    def onlookers(self, rig: str) -> list[str]:
        """Names of everybody who watches, the operator left out."""
        now = self._clock()
        with self._lock:
            people = self._people(rig)
            people.asked = {name: asked for name, asked in people.asked.items() if now - asked < WATCHES_FOR}
            return sorted((people.asked.keys() | people.live.keys()) - {people.operator})
