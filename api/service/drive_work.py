"""Work on the drives of a rig that moves nothing and takes some seconds, by who operates the rig, alone on its bus."""

from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass

from api.service.accounts import User
from api.service.audit import AuditLog
from api.service.bus_claims import BusClaims
from api.service.rig_operators import RigOperators
from daq.homing import require_lasting_drives
from daq.rig import Rig
from identify.recording.errors import InputError


@dataclass(frozen=True)
class _AtRest:
    """What has the bus meanwhile."""

    refusal: str
    moves: bool = False


class DriveWork:
    """Who works on the drives of a rig, one piece of work at a time."""

    def __init__(self, operators: RigOperators, claims: BusClaims, audit: AuditLog) -> None:
        self._operators = operators
        self._claims = claims
        self._audit = audit

    def why_not(self, settings: Rig) -> str:
        """Why nobody can work on the drives of a rig at all; empty where somebody can."""
        try:
            require_lasting_drives(settings)
        except InputError as error:
            return str(error)
        return ""

    @contextmanager
    def on(
        self, rig: str, settings: Rig, user: User, *, action: str, target: str, refusal: str, client: str = ""
    ) -> Iterator[None]:
        """Have the rig and its bus while the block runs; what is done there stands in the audit log before it is done.

        action, target : for the audit log
        refusal        : for somebody else who wants the bus meanwhile
        client         : address of who asked

        Raises the problem 409 while somebody else operates the rig, or a session or homing its bus, and InputError for a rig
        whose drives live only as long as a session.
        """
        require_lasting_drives(settings)
        self._operators.take(rig, user)
        with self._claims.claim(rig, settings.bus, _AtRest(refusal)):
            self._audit.append(user, action, target, "asked", client=client)
            yield
