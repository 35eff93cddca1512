"""What a drive held before it was set up: kept at the first writing of each object, put back when the bus is left.

A drive belongs to a machine whose own controller counts on what it has set: the watch over its heartbeat, its mapping, its cycle.
Such settings are put back. Commands are not: controlword, mode, target and offset of the torque move an axis, and whoever leaves
a drive leaves it at rest. Nor are objects that are written to stay (`SdoAccess.lasting`).
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, field

from drivers import cia402
from drivers.errors import DriveError
from drivers.process_data import PdoParameters, read_pdo, was_refused
from drivers.restored_pdo import pdo_of, restore_pdo
from drivers.sdo import SdoAccess

COMMANDS = frozenset(
    {cia402.CONTROLWORD, cia402.MODE_OF_OPERATION, cia402.TARGET_TORQUE, cia402.TORQUE_OFFSET}
)
"""objects that are written to move an axis or to stop it"""

Address = tuple[int, int]
"""index and subindex of an object"""


@dataclass
class HeldSettings:
    """What a drive held; goes from one process to another.

    objects : bytes of each object, in the order in which they were first written
    pdos    : by TPDO or RPDO and number; COB-ID, transmission type and mapping, which are written in an order of their own
    """

    objects: dict[Address, bytes] = field(default_factory=dict[Address, bytes])
    pdos: dict[tuple[str, int], PdoParameters] = field(default_factory=dict[tuple[str, int], PdoParameters])


class AsFound:
    """Keeps what one drive held, and puts it back.

    sdo : tells before it writes an object that was not written to stay
    """

    def __init__(self, sdo: SdoAccess) -> None:
        self._sdo = sdo
        self.held = HeldSettings()
        self._asked: set[Address] = set()
        sdo.about_to_write = self._note

    def keep(self, pdos: Iterable[PdoParameters]) -> None:
        """PDOs as they were read before anything of them was written."""
        for pdo in pdos:
            self.held.pdos.setdefault((pdo.kind, pdo.number), pdo)

    def _note(self, index: int, subindex: int) -> None:
        address = (index, subindex)
        if index in COMMANDS or address in self._asked or address in self.held.objects:
            return
        self._asked.add(address)
        # What cannot be read is written all the same, or refused there with its reason.
        try:
            pdo = pdo_of(index, subindex)
            if pdo is None:
                self.held.objects[address] = self._sdo.read_bytes(index, subindex, "keeping what it holds")
            elif pdo not in self.held.pdos and (present := read_pdo(self._sdo, *pdo)) is not None:
                self.held.pdos[pdo] = present
        except DriveError:
            return

    def put_back(self, only: Iterable[int] | None = None) -> list[str]:
        """Write what differs from what was held; what the drive does not take back, in words.

        only : indices of the objects; None for all, PDOs too, what was written last first

        Raises DriveError where the drive does not answer: it is not asked again.
        """
        left: list[str] = []
        if only is None:
            for (kind, number), pdo in self.held.pdos.items():
                try:
                    restore_pdo(self._sdo, pdo)
                except DriveError as refusal:
                    left.append(_unless_silent(refusal, f"{kind} {number}"))
        chosen = None if only is None else frozenset(only)
        for (index, subindex), data in reversed(self.held.objects.items()):
            if chosen is not None and index not in chosen:
                continue
            try:
                if self._sdo.read_bytes(index, subindex, _DOING) != data:
                    self._sdo.write_bytes(index, subindex, data, _DOING)
            except DriveError as refusal:
                left.append(_unless_silent(refusal, f"0x{index:04X}:{subindex:02X}"))
        return left


_DOING = "putting back what it held before"


def _unless_silent(refusal: DriveError, what: str) -> str:
    """What was refused; raises the error of a drive that does not answer."""
    if not was_refused(refusal):
        raise refusal
    return what
