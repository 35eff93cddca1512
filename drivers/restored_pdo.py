"""A PDO written back as it was read: off, its mapping and transmission type, and on again where it was on."""

from drivers.errors import DriveError
from drivers.process_data import PDO_OFF, PdoParameters, pdo_objects, read_pdo
from drivers.sdo import SdoAccess


def pdo_of(index: int, subindex: int) -> tuple[str, int] | None:
    """TPDO or RPDO and the number of the PDO whose COB-ID, transmission type or mapping an object is; None for any other."""
    for kind, base in (("RPDO", 0x1400), ("TPDO", 0x1800)):
        parameters, mapping = base <= index < base + 0x200, base + 0x200 <= index < base + 0x400
        if mapping or (parameters and subindex in (1, 2)):
            return kind, (index - base) % 0x200 + 1
    return None


def restore_pdo(sdo: SdoAccess, held: PdoParameters) -> None:
    """Have a PDO be as it was, in the order of CiA 301 (section 7.5.2.36); only what differs is written.

    Raises DriveError when the drive refuses, does not answer, or says something else afterwards.
    """
    present = read_pdo(sdo, held.kind, held.number)
    if present is None or present == held:
        return
    communication, mapping = pdo_objects(held.kind, held.number)
    what = f"putting {held.kind} {held.number} back"
    off = (present.mapping, present.transmission_type, present.can_id) != (
        held.mapping,
        held.transmission_type,
        held.can_id,
    )
    if off and present.valid:
        sdo.write(communication, 1, "uint32", present.cob_id | PDO_OFF, what)
    if present.mapping != held.mapping:
        sdo.write(mapping, 0, "uint8", 0, what)
    if present.transmission_type != held.transmission_type:
        sdo.write(communication, 2, "uint8", held.transmission_type, what)
    if present.mapping != held.mapping:
        for position, entry in enumerate(held.mapping, 1):
            sdo.write(mapping, position, "uint32", entry, what)
        sdo.write(mapping, 0, "uint8", len(held.mapping), what)
    sdo.write(communication, 1, "uint32", held.cob_id, what)
    restored = read_pdo(sdo, held.kind, held.number)
    if restored != held:
        raise DriveError(
            sdo.node,
            what,
            index=communication,
            subindex=1,
            expected=f"COB-ID 0x{held.cob_id:X} with its {len(held.mapping)} entries",
            received="none came" if restored is None else f"0x{restored.cob_id:X} came",
        )
