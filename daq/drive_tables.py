"""Writing a drive's own compensation tables: nothing to a drive with power or in motion; all read back, or all as before."""

import contextlib
from collections.abc import Callable, Sequence
from dataclasses import dataclass

from daq.rig import Rig
from daq.rig_check import check_rig
from daq.rig_drives import RigDrives
from drivers.drive import Drive
from drivers.errors import DriverError
from identify.recording.errors import InputError


@dataclass(frozen=True)
class ObjectWrite:
    """One object and the raw value that it is to hold."""

    index: int
    subindex: int
    type: str
    value: float

    def __str__(self) -> str:
        return f"0x{self.index:04X}:{self.subindex:02X}"


def write_tables(
    rig: Rig,
    tables: Sequence[Sequence[ObjectWrite]],
    about_to_write: Callable[[list[list[float]]], None] | None = None,
) -> list[list[float]]:
    """Write to every drive its objects, in their order, and read them back. What each held before.

    tables         : of each axis; none for an axis that is left alone
    about_to_write : called with what all objects hold before, ahead of the first writing
    The bus is claimed meanwhile. All drives are looked at first as before a session: nothing is written where one has power,
    moves or has a fault. Where an object is refused or reads back differently, all that were written get back what they held.

    Raises InputError where the check finds something, DriverError where a drive refuses, also with what could not be given back,
    BusInUse while somebody else has the bus.
    """
    drives = RigDrives(rig, "writing compensation tables")
    try:
        check = check_rig(drives)
        if not check.ok:
            raise InputError(f"rig {rig.name}: nothing was written: {check.problems}")
        before = [
            [float(drive.sdo.read(each.index, each.subindex, each.type)) for each in writes]
            for drive, writes in zip(drives.drives, tables, strict=True)
        ]
        if about_to_write is not None:
            about_to_write(before)
        undo: list[tuple[Drive, ObjectWrite, float]] = []
        try:
            for drive, writes, held in zip(drives.drives, tables, before, strict=True):
                for each, value in zip(writes, held, strict=True):
                    undo.append((drive, each, value))
                    _write(drive, each, each.value)
            for drive, writes in zip(drives.drives, tables, strict=True):
                _compare(drive, writes)
        except BaseException as problem:
            left = _left_changed(undo)
            if not left:
                raise
            raise DriverError(
                f"{problem or 'the writing was interrupted'}; what these held before could not be written again: {left}; write"
                " it back when they answer"
            ) from problem
        return before
    finally:
        drives.close()


def _left_changed(undo: Sequence[tuple[Drive, ObjectWrite, float]]) -> str:
    """Write what the objects held before, the last first. Those that are not read back so, in words; a drive that is silent once
    is not asked again."""
    left: dict[int, list[ObjectWrite]] = {}
    silent: set[int] = set()
    for drive, each, value in reversed(undo):
        if drive.node not in silent:
            with contextlib.suppress(DriverError):
                _write(drive, each, value)
                continue
            try:
                # one that refuses to be written may hold it still
                if drive.sdo.read(each.index, each.subindex, each.type) == value:
                    continue
            except DriverError:
                silent.add(drive.node)
        left.setdefault(drive.node, []).append(each)
    return ", ".join(
        f"node {node} {first}"
        if len(of_node) == 1
        else f"node {node} {first} to {last} ({len(of_node)} objects)"
        for node, of_node in left.items()
        for first, last in [(of_node[-1], of_node[0])]
    )


def _write(drive: Drive, each: ObjectWrite, value: float) -> None:
    whole = each.type != "float32"
    with drive.sdo.lasting():
        drive.sdo.write_verified(
            each.index,
            each.subindex,
            each.type,
            int(value) if whole else value,
            "writing a compensation table",
        )


def _compare(drive: Drive, writes: Sequence[ObjectWrite]) -> None:
    """Once all of a table stand: a drive may have changed an object when another one was written."""
    for each in writes:
        held = drive.sdo.read(each.index, each.subindex, each.type, "reading a compensation table back")
        if held != each.value:
            raise InputError(
                f"node {drive.node}: {each} holds {held:g}, not {each.value:g}, once all of the table stand; what was before"
                " was written again"
            )
