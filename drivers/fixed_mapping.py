"""Process data of a drive whose mapping cannot be changed: used as they stand where they carry what is needed."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from drivers.cia402 import Mode
from drivers.errors import DriveError
from drivers.process_data import (
    SYNCHRONOUS,
    MappedEntry,
    PdoParameters,
    ProcessData,
    lay_out,
    set_transmission_type,
)
from drivers.sdo import SdoAccess

_KIND_OF_BITS = {8: "<u1", 16: "<u2", 32: "<u4"}
_MODE = 0x6060
_PDO_BITS = 64


@dataclass(frozen=True)
class OwnPdos:
    """PDOs of one direction as a drive has them, those that carry something that is needed.

    pdos    : each with its entries by our names, `other` where we have none
    lacking : what of that none carries, in words; nothing where they serve
    """

    pdos: tuple[tuple[PdoParameters, tuple[MappedEntry, ...]], ...]
    lacking: str = ""


def own_transmit_pdos(present: Sequence[PdoParameters], wanted: Sequence[MappedEntry]) -> OwnPdos:
    """The TPDOs that carry what is wanted in every cycle."""
    pdos: list[tuple[PdoParameters, tuple[MappedEntry, ...]]] = []
    for pdo in present:
        entries = _named(pdo, wanted) if pdo.kind == "TPDO" and pdo.valid else ()
        if any(entry.name != "other" for entry in entries):
            pdos.append((pdo, entries))
    carried = {entry.name for _, entries in pdos for entry in entries}
    lacking = [
        f"{each.name} (0x{each.index:04X}:{each.subindex:02X})" for each in wanted if each.name not in carried
    ]
    return OwnPdos(tuple(pdos), f"{lacking[0]} in a TPDO that is on" if lacking else "")


def own_receive_pdo(present: Sequence[PdoParameters], wanted: Sequence[MappedEntry]) -> OwnPdos:
    """The RPDO that takes all that is wanted, controlword and target first of all."""
    for pdo in present:
        entries = _named(pdo, wanted) if pdo.kind == "RPDO" and pdo.valid else ()
        if {each.name for each in wanted} <= {entry.name for entry in entries}:
            return OwnPdos(((pdo, entries),))
    named = [
        each.name + (f" (0x{each.index:04X}:{each.subindex:02X})" if each.name == "target" else "")
        for each in wanted
    ]
    return OwnPdos((), f"{' and '.join(named)} together in a RPDO that is on")


def used_as_they_stand(sdo: SdoAccess, serving: OwnPdos) -> tuple[ProcessData, ...]:
    """The PDOs switched on and synchronous, as far as they are not.

    Raises DriveError when they lack something, or the drive refuses.
    """
    if serving.lacking:
        raise DriveError(
            sdo.node,
            "using its PDOs unchanged, as their mapping cannot be changed",
            expected=serving.lacking,
            received="none carries it; map it with the maker's tool",
        )
    return tuple(ProcessData(pdo.can_id, _synchronous(sdo, pdo), entries) for pdo, entries in serving.pdos)


def constants(sdo: SdoAccess, receive: ProcessData, mode: Mode) -> tuple[int, ...]:
    """What the entries that we have no use for go on holding: the mode that is asked for, or what stands in the object.

    Raises DriveError when the drive does not answer.
    """
    return tuple(_constant(sdo, entry, mode) for entry in receive.entries if entry.name == "other")


def _named(pdo: PdoParameters, wanted: Sequence[MappedEntry]) -> tuple[MappedEntry, ...]:
    """The entries of a mapping, those that are wanted by their names; none where one has a length that we do not read."""
    known = {each.mapping: each for each in wanted}
    entries: list[MappedEntry] = []
    for mapping in pdo.mapping:
        kind = _KIND_OF_BITS.get(mapping & 0xFF)
        if mapping not in known and kind is None:
            return ()
        other = MappedEntry("other", mapping >> 16, mapping >> 8 & 0xFF, kind or "<u4")
        entries.append(known.get(mapping, other))
    return lay_out(entries) if sum(entry.bits for entry in entries) <= _PDO_BITS else ()


def _synchronous(sdo: SdoAccess, pdo: PdoParameters) -> int:
    """Have a PDO be on, as it was, and go with every SYNC; one that does so already is left alone."""
    what = f"letting {pdo.kind} {pdo.number} go with SYNC"
    if sdo.read(pdo.communication, 1, "uint32", what) != pdo.cob_id:
        sdo.write_verified(pdo.communication, 1, "uint32", pdo.cob_id, what)
    if pdo.transmission_type == SYNCHRONOUS or (pdo.kind == "RPDO" and pdo.transmission_type <= 240):
        return pdo.transmission_type
    return set_transmission_type(sdo, pdo, SYNCHRONOUS, what)


def _constant(sdo: SdoAccess, entry: MappedEntry, mode: Mode) -> int:
    if entry.index == _MODE:
        return mode.value & 0xFF
    data = sdo.read_bytes(entry.index, entry.subindex, "reading a mapped object")
    return int.from_bytes(data[: entry.bits // 8], "little")
