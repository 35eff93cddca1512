"""Process data: which values travel in which PDO, written to the drive and read back.

A mapping is written in the order that CiA 301 section 7.5.2.36 asks for: PDO off, no entries, transmission
type, entries, their number, PDO on. Then everything is read back: what stands in `ProcessData` is what the
drive says, not what we wished.
"""

import itertools
import struct
from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property

from drivers.errors import DriveError
from drivers.sdo import SdoAccess

PDO_OFF = 1 << 31
_NO_RTR = 1 << 30
_STRUCT_OF_KIND = {"<i1": "b", "<i2": "h", "<i4": "i", "<u1": "B", "<u2": "H", "<u4": "I", "<f4": "f"}
_BITS_OF_KIND = {"<i1": 8, "<i2": 16, "<i4": 32, "<u1": 8, "<u2": 16, "<u4": 32, "<f4": 32}
SYNCHRONOUS = 1  # transmission type: at every SYNC
EVENT_DRIVEN = 254
"""Transmission types from here on do not wait for SYNC."""
TORQUE_OFFSET = "torque offset"
"""name of the entry 0x60B2 of a setpoint"""
TARGET_TORQUE = "target torque"
"""name of the entry 0x6071 of a setpoint, beside a target position"""


@dataclass(frozen=True)
class MappedEntry:
    """One object inside a PDO.

    name        : what it is to us: position, command, statusword, temperature, controlword, target
    kind        : NumPy's scalar type, e.g. "<i4"
    byte_offset : where it starts in the frame's data
    """

    name: str
    index: int
    subindex: int
    kind: str
    byte_offset: int = 0

    @property
    def bits(self) -> int:
        """Length in bits."""
        return _BITS_OF_KIND[self.kind]

    @property
    def mapping(self) -> int:
        """The entry as an object 0x1600/0x1A00 holds it."""
        return self.index << 16 | self.subindex << 8 | self.bits


@dataclass(frozen=True)
class ProcessData:
    """One PDO as the drive confirmed it."""

    can_id: int
    transmission_type: int
    entries: tuple[MappedEntry, ...]
    fixed_id: bool = False
    """Whether its COB-ID can only be read."""

    @property
    def length(self) -> int:
        """Bytes of data in its frame."""
        return sum(entry.bits for entry in self.entries) // 8

    @property
    def packer(self) -> struct.Struct:
        """Packs and unpacks all entries in their order."""
        return struct.Struct("<" + "".join(_STRUCT_OF_KIND[entry.kind] for entry in self.entries))

    def entry(self, name: str) -> MappedEntry:
        """The entry of that name.

        Raises KeyError when it is not in this PDO.
        """
        for entry in self.entries:
            if entry.name == name:
                return entry
        raise KeyError(name)


@dataclass(frozen=True)
class DriveStream:
    """What a drive sends and takes in every cycle.

    transmit : its TPDOs, each answered at every SYNC
    receive  : its RPDO with controlword and target, effective at the next SYNC
    constants : values of the RPDO's further entries, in their order; a mapping that cannot be changed may have some
    """

    node: int
    transmit: tuple[ProcessData, ...]
    receive: ProcessData
    constants: tuple[int, ...] = ()

    def find(self, name: str) -> tuple[ProcessData, MappedEntry]:
        """The TPDO and entry that carry a value.

        Raises KeyError when no TPDO does.
        """
        for pdo in self.transmit:
            for entry in pdo.entries:
                if entry.name == name:
                    return pdo, entry
        raise KeyError(name)

    @property
    def transmit_ids(self) -> tuple[int, ...]:
        """CAN ids of the TPDOs."""
        return tuple(pdo.can_id for pdo in self.transmit)

    def setpoint(self, controlword: int, target: int) -> bytes:
        """Data of the RPDO for `receive.can_id`; target in the raw unit of the mode's target object."""
        return self.packed(controlword, target)

    @cached_property
    def packed(self) -> Callable[[int, int], bytes]:
        """`setpoint` as a function that is quick to call in every cycle; a torque beside the target is nought."""
        pack = self.receive.packer.pack
        names = [entry.name for entry in self.receive.entries]
        if self.torque_entry is not None:
            with_torque = self.packed_with_torque
            return lambda controlword, target: with_torque(controlword, target, 0)
        if len(names) == 2 and not self.constants:
            return pack if names[0] != "target" else lambda controlword, target: pack(target, controlword)
        rest = iter(self.constants)
        values = [0 if name in ("controlword", "target") else next(rest) for name in names]
        word, target_at = names.index("controlword"), names.index("target")

        def packed(controlword: int, target: int) -> bytes:
            values[word], values[target_at] = controlword, target
            return pack(*values)

        return packed

    @property
    def torque_entry(self) -> str | None:
        """Which torque the RPDO has beside the target, by its entry's name; None where it has none."""
        names = [entry.name for entry in self.receive.entries]
        return next((name for name in (TORQUE_OFFSET, TARGET_TORQUE) if name in names), None)

    @cached_property
    def packed_with_torque(self) -> Callable[[int, int, int], bytes]:
        """Controlword, target and torque (per mille of the rated torque) as the RPDO's data."""
        pack, constants = self.receive.packer.pack, self.constants
        names = ["controlword", "target", self.torque_entry]
        further = itertools.count(len(names))
        order = [
            names.index(entry.name) if entry.name in names else next(further)
            for entry in self.receive.entries
        ]

        def packed(*values: int) -> bytes:
            held = (*values, *constants)
            return pack(*(held[place] for place in order))

        return packed


def lay_out(entries: list[MappedEntry]) -> tuple[MappedEntry, ...]:
    """Entries with their byte offsets.

    Raises ValueError when they are longer than the 8 bytes of a PDO.
    """
    placed: list[MappedEntry] = []
    offset = 0
    for entry in entries:
        placed.append(MappedEntry(entry.name, entry.index, entry.subindex, entry.kind, offset))
        offset += entry.bits // 8
    if offset > 8:
        raise ValueError(f"{', '.join(e.name for e in entries)} need {offset} bytes; a PDO has 8")
    return tuple(placed)


def distribute(entries: list[MappedEntry]) -> list[list[MappedEntry]]:
    """Spread entries over as few PDOs as first-fit finds, in their order."""
    pdos: list[list[MappedEntry]] = []
    for entry in entries:
        for pdo in pdos:
            if sum(e.bits for e in pdo) + entry.bits <= 64:
                pdo.append(entry)
                break
        else:
            pdos.append([entry])
    return pdos


@dataclass(frozen=True)
class PdoParameters:
    """A PDO as a drive has it now."""

    kind: str
    """TPDO or RPDO"""
    number: int
    cob_id: int
    """with its bits 30 and 31"""
    transmission_type: int
    mapping: tuple[int, ...]
    """entries as objects 0x1600 and 0x1A00 hold them"""

    @property
    def valid(self) -> bool:
        """Whether it is switched on."""
        return not self.cob_id & PDO_OFF

    @property
    def can_id(self) -> int:
        """The id of its frames."""
        return self.cob_id & 0x7FF

    @property
    def communication(self) -> int:
        """Index of its communication parameters."""
        return pdo_objects(self.kind, self.number)[0]


@dataclass(frozen=True)
class WantedPdo:
    """A PDO as we want a drive to have it.

    kind    : "TPDO" or "RPDO"
    number  : 1 for the first PDO
    can_id  : a PDO whose COB-ID can only be read keeps its own
    entries : as `lay_out` places them
    """

    kind: str
    number: int
    can_id: int
    transmission_type: int
    entries: tuple[MappedEntry, ...]

    @property
    def communication(self) -> int:
        """Index of its communication parameters."""
        return pdo_objects(self.kind, self.number)[0]

    @property
    def mapping(self) -> int:
        """Index of its mapping."""
        return pdo_objects(self.kind, self.number)[1]

    def remapped(self, present: PdoParameters) -> bool:
        """Whether the drive has another mapping now."""
        return present.mapping != tuple(entry.mapping for entry in self.entries)

    def readdressed(self, present: PdoParameters) -> bool:
        """Whether it has another id now, or is off."""
        return not present.valid or present.can_id != self.can_id

    def retimed(self, present: PdoParameters) -> bool:
        """Whether it has another transmission type now."""
        return present.transmission_type != self.transmission_type

    def differs(self, present: PdoParameters) -> bool:
        """Whether anything is to be written."""
        return self.remapped(present) or self.readdressed(present) or self.retimed(present)

    def missing(self, node: int) -> DriveError:
        """What is said of a drive that has no PDO of that number."""
        what, expected = f"mapping {self.kind} {self.number}", f"a {self.kind} {self.number}"
        received = "the drive has none"
        return DriveError(
            node, what, index=self.communication, subindex=1, expected=expected, received=received
        )


def read_pdo(sdo: SdoAccess, kind: str, number: int) -> PdoParameters | None:
    """A PDO as it stands; None where the drive has none of that number.

    Raises DriveError when the drive does not answer.
    """
    communication, mapping = pdo_objects(kind, number)
    what = f"reading {kind} {number}"
    try:
        cob_id = sdo.read(communication, 1, "uint32", what)
        transmission_type = sdo.read(communication, 2, "uint8", what)
        count = sdo.read(mapping, 0, "uint8", what)
    except DriveError as refusal:
        if is_missing(refusal):
            return None
        raise
    entries = tuple(sdo.read(mapping, position, "uint32", what) for position in range(1, min(count, 64) + 1))
    return PdoParameters(kind, number, cob_id, transmission_type, entries)


def is_missing(refusal: DriveError) -> bool:
    """Whether a drive refused because it has no such object (abort codes 0x06020000 and 0x06090011 of CiA 301)."""
    return "does not exist" in refusal.received


def was_refused(refusal: DriveError) -> bool:
    """Whether a drive answered that it does not do what was asked (and did not keep silent, or said something else)."""
    return refusal.received.startswith("the drive refused")


def pdo_objects(kind: str, number: int) -> tuple[int, int]:
    """Indices of the communication parameters and the mapping of a PDO (CiA 301), TPDO or RPDO, counted from 1."""
    communication, mapping = (0x1800, 0x1A00) if kind == "TPDO" else (0x1400, 0x1600)
    return communication + number - 1, mapping + number - 1


def write_pdo(sdo: SdoAccess, wanted: WantedPdo) -> ProcessData:
    """Set up a PDO, writing only what differs, and read back what was written.

    Raises DriveError when the drive refuses or says something else afterwards.
    """
    kind, communication, mapping = wanted.kind, wanted.communication, wanted.mapping
    can_id, transmission_type = wanted.can_id, wanted.transmission_type
    what = f"mapping {kind} {wanted.number}"
    present = read_pdo(sdo, kind, wanted.number)
    if present is None:
        raise wanted.missing(sdo.node)
    flags = present.cob_id & _NO_RTR
    fixed_id = False
    if wanted.differs(present):
        fixed_id = (present.valid or present.can_id != can_id) and not _switched_off(
            sdo, communication, PDO_OFF | flags | can_id, what, usable=present.valid
        )
        if fixed_id:
            can_id = present.can_id
        if wanted.remapped(present):
            sdo.write(mapping, 0, "uint8", 0, what)
        if wanted.retimed(present):
            transmission_type = set_transmission_type(sdo, present, transmission_type, what)
        if wanted.remapped(present):
            for position, entry in enumerate(wanted.entries, 1):
                sdo.write(mapping, position, "uint32", entry.mapping, f"{what}, entry {entry.name}")
            sdo.write(mapping, 0, "uint8", len(wanted.entries), what)
        if not fixed_id:
            sdo.write(communication, 1, "uint32", flags | can_id, what)
    _confirm(sdo, mapping, 0, "uint8", len(wanted.entries), what)
    for position, entry in enumerate(wanted.entries, 1):
        _confirm(sdo, mapping, position, "uint32", entry.mapping, f"{what}, entry {entry.name}")
    _confirm(sdo, communication, 2, "uint8", transmission_type, what)
    confirmed = sdo.read(communication, 1, "uint32", what)
    if confirmed & ~_NO_RTR != can_id:
        raise DriveError(
            sdo.node,
            what,
            index=communication,
            subindex=1,
            expected=f"COB-ID 0x{can_id:X}",
            received=f"0x{confirmed:X} came",
        )
    return ProcessData(can_id, transmission_type, wanted.entries, fixed_id)


def _switched_off(sdo: SdoAccess, communication: int, cob_id: int, what: str, *, usable: bool) -> bool:
    """Write a COB-ID whose bit 31 is set; False where it can only be read, and the PDO is usable with the one that it has."""
    try:
        sdo.write(communication, 1, "uint32", cob_id, what)
    except DriveError as refusal:
        if not (usable and was_refused(refusal)):
            raise
        return False
    return True


def set_transmission_type(sdo: SdoAccess, pdo: PdoParameters, wanted: int, what: str) -> int:
    """The transmission type that a PDO has then: an RPDO whose type can only be read is used as it stands.

    At SYNC (0 to 240) or at once (254, 255), its setpoint is taken in time. Raises DriveError when a TPDO's is refused.
    """
    try:
        sdo.write_verified(pdo.communication, 2, "uint8", wanted, what)
    except DriveError as refusal:
        usable = pdo.transmission_type <= 240 or pdo.transmission_type >= EVENT_DRIVEN
        if pdo.kind != "RPDO" or not was_refused(refusal) or not usable:
            raise
        return pdo.transmission_type
    return wanted


def switch_off_pdo(sdo: SdoAccess, kind: str, number: int) -> None:
    """Make a PDO invalid (bit 31 of its COB-ID) and check that it is; one that the drive does not have is left alone.

    Raises DriveError when the drive refuses.
    """
    communication, _mapping = pdo_objects(kind, number)
    what = f"switching {kind} {number} off"
    try:
        cob_id = sdo.read(communication, 1, "uint32", what)
    except DriveError as refusal:
        if is_missing(refusal):
            return
        raise
    if not cob_id & PDO_OFF:
        sdo.write(communication, 1, "uint32", cob_id | PDO_OFF, what)
        if not sdo.read(communication, 1, "uint32", what) & PDO_OFF:
            raise DriveError(
                sdo.node, what, index=communication, subindex=1, expected="bit 31", received="it stayed valid"
            )


def _confirm(sdo: SdoAccess, index: int, subindex: int, kind: str, expected: int, what: str) -> None:
    received = sdo.read(index, subindex, kind, what)
    if received != expected:
        raise DriveError(
            sdo.node,
            what,
            index=index,
            subindex=subindex,
            expected=f"0x{expected:X}",
            received=f"0x{received:X} came",
        )
