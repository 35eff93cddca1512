"""Process data of a drive whose mapping cannot be changed: used as they stand where they carry what is needed."""

from __future__ import annotations

from collections.abc import Sequence

from drivers.cia402 import CONTROLWORD, Mode
from drivers.errors import DriveError
from drivers.process_data import SYNCHRONOUS, DriveStream, MappedEntry, PdoParameters, ProcessData, lay_out
from drivers.sdo import SdoAccess
from drivers.standard_stream import TARGETS

_KIND_OF_BITS = {8: "<u1", 16: "<u2", 32: "<u4"}
_MODE = 0x6060


def stream_of_fixed_mapping(
    sdo: SdoAccess, present: Sequence[PdoParameters], wanted: Sequence[MappedEntry], mode: Mode
) -> DriveStream:
    """The stream that a drive's own PDOs make.

    present : its PDOs as they were read
    wanted  : what it must send in every cycle
    mode    : says which target it must take

    Raises DriveError in words that name what is missing.
    """
    transmit = [pdo for pdo in present if pdo.kind == "TPDO" and pdo.valid]
    chosen: list[ProcessData] = []
    for pdo in transmit:
        entries = _named(pdo, {each.mapping: each for each in wanted})
        if entries is not None and any(entry.name != "other" for entry in entries):
            chosen.append(ProcessData(pdo.can_id, _synchronous(sdo, pdo), lay_out(entries)))
    carried = {entry.name for pdo in chosen for entry in pdo.entries}
    for each in wanted:
        if each.name not in carried:
            raise _lacks(sdo, f"{each.name} (0x{each.index:04X}:{each.subindex:02X})", "TPDO")
    index, subindex, kind = TARGETS[mode]
    asked = [MappedEntry("controlword", CONTROLWORD, 0, "<u2"), MappedEntry("target", index, subindex, kind)]
    for pdo in present:
        if pdo.kind != "RPDO" or not pdo.valid:
            continue
        entries = _named(pdo, {each.mapping: each for each in asked})
        if entries is not None and {"controlword", "target"} <= {entry.name for entry in entries}:
            receive = ProcessData(pdo.can_id, _synchronous(sdo, pdo), lay_out(entries))
            constants = tuple(_constant(sdo, entry, mode) for entry in entries if entry.name == "other")
            return DriveStream(sdo.node, tuple(chosen), receive, constants)
    raise _lacks(sdo, f"controlword and target (0x{index:04X}:{subindex:02X}) together", "RPDO")


def _named(pdo: PdoParameters, known: dict[int, MappedEntry]) -> list[MappedEntry] | None:
    """The entries of a mapping, those that are known by their names; None where one has a length that we do not read."""
    entries: list[MappedEntry] = []
    for mapping in pdo.mapping:
        kind = _KIND_OF_BITS.get(mapping & 0xFF)
        if mapping not in known and kind is None:
            return None
        other = MappedEntry("other", mapping >> 16, mapping >> 8 & 0xFF, kind or "<u4")
        entries.append(known.get(mapping, other))
    return entries


def _synchronous(sdo: SdoAccess, pdo: PdoParameters) -> int:
    """Have a PDO be on, as it was, and go with every SYNC; one that does so already is left alone."""
    communication = (0x1800 if pdo.kind == "TPDO" else 0x1400) + pdo.number - 1
    what = f"letting {pdo.kind} {pdo.number} go with SYNC"
    if sdo.read(communication, 1, "uint32", what) != pdo.cob_id:
        sdo.write_verified(communication, 1, "uint32", pdo.cob_id, what)
    if pdo.transmission_type == SYNCHRONOUS or (pdo.kind == "RPDO" and pdo.transmission_type <= 240):
        return pdo.transmission_type
    sdo.write_verified(communication, 2, "uint8", SYNCHRONOUS, what)
    return SYNCHRONOUS


def _constant(sdo: SdoAccess, entry: MappedEntry, mode: Mode) -> int:
    """What an entry that we have no use for goes on holding: the mode that is asked for, or what stands in the object."""
    if entry.index == _MODE:
        return mode.value & 0xFF
    data = sdo.read_bytes(entry.index, entry.subindex, "reading a mapped object")
    return int.from_bytes(data[: entry.bits // 8], "little")


def _lacks(sdo: SdoAccess, what: str, kind: str) -> DriveError:
    return DriveError(
        sdo.node,
        "using its PDOs unchanged, as their mapping cannot be changed",
        expected=f"{what} in a {kind} that is on",
        received="none carries it; map it with the maker's tool",
    )
