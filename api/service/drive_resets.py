"""Faults of a rig's drives are reset through the service, by who operates the rig, while nothing else has its bus."""

from dataclasses import dataclass

from api.service.accounts import User
from api.service.audit import AuditLog
from api.service.bus_claims import BusClaims
from api.service.rig_operators import RigOperators
from api.service.rig_store import RigStore
from daq.drive_reset import ResetJoint, reset_drives
from daq.homing import require_lasting_drives


@dataclass(frozen=True)
class _Reset:
    """What has the bus meanwhile."""

    moves: bool = False
    refusal: str = "Its drives are being reset; that takes some seconds."


class DriveResets:
    """Resets the drives of a rig, one reset at a time."""

    def __init__(self, rigs: RigStore, operators: RigOperators, claims: BusClaims, audit: AuditLog) -> None:
        self._rigs = rigs
        self._operators = operators
        self._claims = claims
        self._audit = audit
        self._last: dict[str, list[ResetJoint]] = {}

    def last(self, rig: str) -> list[ResetJoint]:
        """What the last reset of a rig found; empty before there was one."""
        return self._last.get(rig, [])

    def reset(self, rig: str, user: User, client: str = "") -> list[ResetJoint]:
        """Take the power of every drive that has some, reset every fault; no zero is changed. Returns when it is done.

        Raises the problem 409 while somebody else operates the rig, or a session or homing its bus; BusError when the bus cannot
        be used, InputError for a rig whose drives live only as long as a session.
        """
        settings = self._rigs.rig(rig)
        require_lasting_drives(settings)
        self._operators.take(rig, user)
        with self._claims.claim(rig, settings.bus, _Reset()):
            self._audit.append(user, "drive reset", f"rig {rig}", "asked", client=client)
            self._last[rig] = reset_drives(settings)
        return self._last[rig]
