"""A drive's process data set up: as we want them, or as they stand where the drive refuses and they serve."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

from drivers.cia402 import Mode
from drivers.errors import DriveError
from drivers.fixed_mapping import constants, own_receive_pdo, own_transmit_pdos, used_as_they_stand
from drivers.process_data import (
    EVENT_DRIVEN,
    TARGET_TORQUE,
    TORQUE_OFFSET,
    DriveStream,
    PdoParameters,
    ProcessData,
    WantedPdo,
    read_pdo,
    switch_off_pdo,
    was_refused,
    write_pdo,
)
from drivers.profile import DriveProfile
from drivers.sdo import SdoAccess
from drivers.standard_stream import TPDO_BASE

_NO_TORQUE = {
    TORQUE_OFFSET: (
        "feedforward torque is sent as torque offset 0x60B2 beside the target, which this drive does not take there; where its"
        " axis may be held by this computer's position loop instead, axes[].feedforward: cyclic-torque of the rig file says so"
        " (docs/proof.md)"
    ),
    TARGET_TORQUE: (
        "the rig file has axes[].feedforward: cyclic-torque, for which target torque 0x6071 is sent beside the target position,"
        " and this drive does not take it there"
    ),
}
"""by name of the entry: what is said of a drive that refuses it"""


def present_pdos(sdo: SdoAccess, profile: DriveProfile) -> list[PdoParameters]:
    """The first PDOs of either direction, read now.

    Raises DriveError when the drive does not answer.
    """
    return [
        pdo
        for kind, count in (("TPDO", profile.transmit_pdos), ("RPDO", len(TPDO_BASE)))
        for number in range(1, min(count, len(TPDO_BASE)) + 1)
        if (pdo := read_pdo(sdo, kind, number)) is not None
    ]


def require_pdos(node: int, wanted: Sequence[WantedPdo], present: Sequence[PdoParameters]) -> None:
    """Raises DriveError where the drive has fewer TPDOs than are needed, or no RPDO 1."""
    needed = sum(pdo.kind == "TPDO" for pdo in wanted)
    there = sum(pdo.kind == "TPDO" for pdo in present)
    if needed > there:
        raise DriveError(node, "mapping TPDOs", expected=f"{needed} TPDOs", received=f"it has {there}")
    for pdo in wanted:
        if not any((each.kind, each.number) == (pdo.kind, pdo.number) for each in present):
            raise pdo.missing(node)


def set_up_stream(
    sdo: SdoAccess, wanted: Sequence[WantedPdo], present: Sequence[PdoParameters], mode: Mode
) -> tuple[DriveStream, list[str]]:
    """What the drive will send and take, as it was read back, and what was done otherwise than usual, in words.

    present : all its PDOs as they were read, those that are wanted among them

    Raises DriveError when the drive refuses and has none that serves, or says something else afterwards.
    """
    remarks: list[str] = []
    stay_on = _switch_off_others(sdo, wanted, present)
    transmit = _set_up(sdo, [pdo for pdo in wanted if pdo.kind == "TPDO"], present, remarks)
    takes = [pdo for pdo in wanted if pdo.kind == "RPDO"]
    try:
        (receive,) = _set_up(sdo, takes, present, remarks)
    except DriveError as refusal:
        torque = next((entry.name for entry in takes[0].entries if entry.name in _NO_TORQUE), None)
        if torque is not None and was_refused(refusal):
            raise refusal.with_cause(_NO_TORQUE[torque]) from refusal
        raise
    used = {pdo.can_id for pdo in (*transmit, receive)}
    on_beside = [f"{pdo.kind} {pdo.number}" for pdo in stay_on if pdo.can_id not in used]
    if on_beside or any(pdo.fixed_id for pdo in (*transmit, receive)):
        ids = ", ".join(f"0x{pdo.can_id:X}" for pdo in (*transmit, receive))
        stays = f"; {', '.join(on_beside)} cannot be switched off" if on_beside else ""
        remarks.append(f"its COB-IDs can only be read: they are used as they stand ({ids}){stays}")
    if receive.transmission_type >= EVENT_DRIVEN != takes[0].transmission_type:
        remarks.append(
            f"takes setpoints when they come, not at SYNC: its RPDO has transmission type {receive.transmission_type}, "
            "which can only be read"
        )
    return DriveStream(sdo.node, transmit, receive, constants(sdo, receive, mode)), remarks


def _switch_off_others(
    sdo: SdoAccess, wanted: Sequence[WantedPdo], present: Sequence[PdoParameters]
) -> list[PdoParameters]:
    """Switch off the PDOs that are not needed; which stayed on, for they refused."""
    needed = {(pdo.kind, pdo.number) for pdo in wanted}
    stay_on: list[PdoParameters] = []
    for pdo in present:
        if (pdo.kind, pdo.number) in needed or not pdo.valid:
            continue
        try:
            switch_off_pdo(sdo, pdo.kind, pdo.number)
        except DriveError as refusal:
            if not was_refused(refusal):
                raise
            stay_on.append(pdo)
    return stay_on


def _set_up(
    sdo: SdoAccess, wanted: Sequence[WantedPdo], present: Sequence[PdoParameters], remarks: list[str]
) -> tuple[ProcessData, ...]:
    """The PDOs of one direction: as we want them, or where the drive refuses as they stand if they serve."""
    try:
        return tuple(write_pdo(sdo, pdo) for pdo in wanted)
    except DriveError as refusal:
        if not was_refused(refusal):
            raise
        kind = wanted[0].kind
        # Read again, for a part of a mapping may have been written; what is off now we have switched off ourselves.
        read = [read_pdo(sdo, kind, pdo.number) for pdo in present if pdo.kind == kind]
        cob_ids = {pdo.number: pdo.cob_id for pdo in present if pdo.kind == kind}
        now = [
            pdo if pdo.valid else replace(pdo, cob_id=cob_ids[pdo.number]) for pdo in read if pdo is not None
        ]
        entries = [entry for pdo in wanted for entry in pdo.entries]
        serving = own_transmit_pdos(now, entries) if kind == "TPDO" else own_receive_pdo(now, entries)
        try:
            used = used_as_they_stand(sdo, serving)
        except DriveError as lacking:
            raise DriveError(
                sdo.node,
                refusal.doing,
                index=refusal.index,
                subindex=refusal.subindex,
                received=f"{refusal.received}; {lacking.doing}: "
                + "; ".join(filter(None, (lacking.expected, lacking.received))),
            ) from refusal
        mapped = ", ".join(
            f"0x{pdo.can_id:X}: [{', '.join(f'0x{entry.mapping:08X}' for entry in pdo.entries)}]"
            for pdo in used
        )
        remarks.append(f"its PDO mapping cannot be changed; its {kind}s are used unchanged ({mapped})")
        return used
