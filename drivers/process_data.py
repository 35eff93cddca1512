"""Process data: which values travel in which PDO, written to the drive and read back.

A mapping is written in the order that CiA 301 section 7.5.2.36 asks for: PDO off, no entries, transmission
type, entries, their number, PDO on. Then everything is read back: what stands in `ProcessData` is what the
drive says, not what we wished.
"""

import struct
from dataclasses import dataclass

from drivers.errors import DriveError
from drivers.sdo import SdoAccess

_PDO_OFF = 1 << 31
_NO_RTR = 1 << 30
_STRUCT_OF_KIND = {"<i1": "b", "<i2": "h", "<i4": "i", "<u1": "B", "<u2": "H", "<u4": "I", "<f4": "f"}
_BITS_OF_KIND = {"<i1": 8, "<i2": 16, "<i4": 32, "<u1": 8, "<u2": 16, "<u4": 32, "<f4": 32}
SYNCHRONOUS = 1  # transmission type: at every SYNC


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
    """

    node: int
    transmit: tuple[ProcessData, ...]
    receive: ProcessData

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
        return self.receive.packer.pack(controlword, target)


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


def write_pdo(
    sdo: SdoAccess, kind: str, number: int, can_id: int, transmission_type: int, entries: list[MappedEntry]
) -> ProcessData:
    """Write the mapping and communication parameters of a PDO and read all of them back.

    kind   : "TPDO" or "RPDO"
    number : 1 for the first PDO

    Raises DriveError when the drive refuses or says something else afterwards.
    """
    communication, mapping = (0x1800, 0x1A00) if kind == "TPDO" else (0x1400, 0x1600)
    communication += number - 1
    mapping += number - 1
    what = f"mapping {kind} {number}"
    placed = lay_out(entries)
    flags = sdo.read(communication, 1, "uint32", what) & _NO_RTR
    sdo.write(communication, 1, "uint32", _PDO_OFF | flags | can_id, what)
    sdo.write(mapping, 0, "uint8", 0, what)
    sdo.write(communication, 2, "uint8", transmission_type, what)
    for position, entry in enumerate(placed, 1):
        sdo.write(mapping, position, "uint32", entry.mapping, f"{what}, entry {entry.name}")
    sdo.write(mapping, 0, "uint8", len(placed), what)
    sdo.write(communication, 1, "uint32", flags | can_id, what)
    _confirm(sdo, mapping, 0, "uint8", len(placed), what)
    for position, entry in enumerate(placed, 1):
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
    return ProcessData(can_id, transmission_type, placed)


def switch_off_pdo(sdo: SdoAccess, kind: str, number: int) -> None:
    """Make a PDO invalid (bit 31 of its COB-ID) and check that it is."""
    communication = (0x1800 if kind == "TPDO" else 0x1400) + number - 1
    what = f"switching {kind} {number} off"
    cob_id = sdo.read(communication, 1, "uint32", what)
    if not cob_id & _PDO_OFF:
        sdo.write(communication, 1, "uint32", cob_id | _PDO_OFF, what)
        if not sdo.read(communication, 1, "uint32", what) & _PDO_OFF:
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
