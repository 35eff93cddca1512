"""Faults of a rig's drives are reset through the service, by who operates the rig, while nothing else has its bus."""

from api.service.accounts import User
from api.service.drive_work import DriveWork
from api.service.rig_store import RigStore
from daq.drive_reset import ResetJoint, reset_drives


class DriveResets:
    """Resets the drives of a rig, one reset at a time."""

    def __init__(self, rigs: RigStore, work: DriveWork) -> None:
        self._rigs = rigs
        self._work = work
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
        with self._work.on(
            rig,
            settings,
            user,
            action="drive reset",
            target=f"rig {rig}",
            refusal="Its drives are being reset; that takes some seconds.",
            client=client,
        ):
            self._last[rig] = reset_drives(settings)
        return self._last[rig]
