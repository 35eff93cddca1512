"""Rigs: their files, who has the rig, and who looks on.

One operator has a rig at a time. Stopping it needs nothing but a sign-in.
"""

from collections.abc import Callable
from dataclasses import dataclass, field
from pathlib import Path
from threading import Lock

from api.service.accounts import User
from api.service.problems import Problem, not_found
from daq.experiment_folder import experiment_robot
from daq.rig import RIGS, Rig
from identify.recording import ExperimentFile, InputError, Payload

FORGOTTEN_AFTER = 15 * 60.0
"""s without a request from its operator after which others may take a rig that rests."""
LOOKS_ON = 30.0
"""s for which somebody counts as looking on after asking for the rig's state."""


@dataclass
class _Desk:
    """Who is at one rig."""

    operator: str | None = None
    last_request: float = 0.0
    seen: dict[str, float] = field(default_factory=dict)
    live: dict[str, int] = field(default_factory=dict)


class RigStore:
    """All rigs of this service.

    folder : rigs of this lab, beside those that come with the software; a file here replaces one of the
    same name
    """

    def __init__(self, folder: Path, clock: Callable[[], float]) -> None:
        self._folder = folder
        self._clock = clock
        self._desks: dict[str, _Desk] = {}
        self._lock = Lock()
        self.moving: Callable[[str], bool] = lambda rig: False
        """Says whether a session is armed or running on a rig; set by the session desk."""

    # --- files

    def files(self) -> dict[str, Path]:
        """Id -> file of every rig."""
        found = {path.stem: path for path in sorted(RIGS.glob("*.yaml"))}
        if self._folder.is_dir():
            found |= {path.stem: path for path in sorted(self._folder.glob("*.yaml"))}
        return found

    def rig(self, identifier: str) -> Rig:
        """The checked settings of a rig. Raises the problem 404, and InputError if its file is wrong."""
        file = self.files().get(identifier)
        if file is None:
            raise not_found("rig", identifier)
        try:
            return Rig.load(file)
        except InputError as error:
            raise InputError(str(error).replace(f"{file.parent}/", "")) from error

    def experiment_file(self, rig_id: str, name: str) -> ExperimentFile:
        """An experiment without sessions on a rig. Raises InputError for an unknown or wrong rig."""
        if rig_id not in self.files():
            raise InputError(f"rig: {rig_id!r} is not known; known are {', '.join(self.files())}")
        rig = self.rig(rig_id)
        payloads = [Payload.model_validate(payload.model_dump()) for payload in rig.payloads]
        return ExperimentFile(format=1, name=name, robot=experiment_robot(rig), payloads=tuple(payloads))

    # --- who has it

    def operator(self, rig: str) -> str | None:
        """Name of the operator who has the rig, or None."""
        with self._lock:
            return self._current(rig)

    def take(self, rig: str, user: User) -> None:
        """Have the rig. Raises the problem 409 if somebody else has it."""
        with self._lock:
            self._take(rig, user)

    def require(self, rig: str, user: User) -> None:
        """For everything that concerns motion: the rig is the user's, or free and now the user's."""
        self.take(rig, user)

    def release(self, rig: str, user: User) -> None:
        """Give the rig back. Raises the problem 409 if it is not the user's or if it moves."""
        with self._lock:
            desk = self._owned(rig, user)
            if self.moving(rig):
                raise Problem(409, "A session is armed or running; stop it first.")
            desk.operator = None

    def hand_over(self, rig: str, user: User, to: str) -> None:
        """Give the rig to another operator, also during motion. Raises the problem 409 if it is not the
        user's.
        """
        with self._lock:
            desk = self._owned(rig, user)
            desk.operator, desk.last_request = to, self._clock()

    def _take(self, rig: str, user: User) -> None:
        current = self._current(rig)
        if current not in (None, user.name):
            raise Problem(409, f"{current} has the rig {rig}; ask for it to be released or handed over.")
        desk = self._desk(rig)
        desk.operator, desk.last_request = user.name, self._clock()

    def _owned(self, rig: str, user: User) -> _Desk:
        current = self._current(rig)
        if current != user.name:
            raise Problem(409, f"{current or 'Nobody'} has the rig {rig}, not {user.name}.")
        return self._desk(rig)

    def _current(self, rig: str) -> str | None:
        desk = self._desk(rig)
        if desk.operator is None or self.moving(rig):
            return desk.operator
        if self._clock() - desk.last_request > FORGOTTEN_AFTER:
            desk.operator = None
        return desk.operator

    def _desk(self, rig: str) -> _Desk:
        return self._desks.setdefault(rig, _Desk())

    # --- who looks on

    def look(self, rig: str, user: User) -> None:
        """Note that somebody asked for the rig's state."""
        with self._lock:
            desk = self._desk(rig)
            desk.seen[user.name] = self._clock()
            if desk.operator == user.name:
                desk.last_request = self._clock()

    def look_live(self, rig: str, user: User, change: int) -> None:
        """Note that a live view was opened (+1) or closed (-1)."""
        with self._lock:
            live = self._desk(rig).live
            live[user.name] = live.get(user.name, 0) + change
            if live[user.name] <= 0:
                del live[user.name]

    def onlookers(self, rig: str) -> list[str]:
        """Names of everybody who looks on, the operator left out."""
        now = self._clock()
        with self._lock:
            desk = self._desk(rig)
            desk.seen = {name: seen for name, seen in desk.seen.items() if now - seen < LOOKS_ON}
            return sorted((desk.seen.keys() | desk.live.keys()) - {desk.operator})
