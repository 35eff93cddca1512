"""Exports of TwinCAT Scope: channels in groups, each group behind a time column of its own, names beside the word Name.

    Name            axis.position   Name            axis.current
    SampleTime[ms]  1               SampleTime[ms]  2
    Unit            deg             Unit            A

    0               12.5            0               0.31

Layout as read off public readers and exports (pytcs, and others); times are in ms.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from identify.recording.errors import InputError
from identify.recording.foreign.joining import JOINED_TIME, join_on_time
from identify.recording.foreign.table import ForeignColumn, ForeignTable
from identify.recording.units import unit_of

NAME, UNIT = "Name", "Unit"
KEYS = frozenset(
    (
        NAME,
        UNIT,
        "SymbolName",
        "SymbolComment",
        "NetID",
        "NetId",
        "Port",
        "IndexGroup",
        "IndexOffset",
        "Data-Type",
        "SampleTime[ms]",
        "SymbolBased",
        "VariableSize",
        "Offset",
        "ScaleFactor",
        "BitMask",
        "Unit ScaleFactor",
        "Unit Offset",
    )
)
"""What stands in the time columns of the rows above the samples."""
START = "Starttime of export"
"""In a row of its own at the begin of an export, whatever the rows of the channels hold."""
TIME = "time"


def is_scope_header(rows: list[list[str]], width: int) -> bool:
    """Whether rows above the samples name their channels as Scope does: Name, and another key or group, or the start."""
    names = _names_row(rows, width)
    keys = {row[0] for row in rows if row} & KEYS
    project = any(row and row[0].startswith(START) for row in rows)
    return names is not None and (len(keys) > 1 or names.count(NAME) > 1 or project)


def _names_row(rows: list[list[str]], width: int) -> list[str] | None:
    """The row that names the channels: the nearest to the samples that is as wide as they are."""
    fitting = [row for row in rows if row and row[0] == NAME and len(row) >= max(width - 1, 2)]
    return fitting[-1] if fitting else None


def scope_names(rows: list[list[str]], width: int) -> tuple[list[str], list[str]]:
    """Names of all columns, those of times being time, time:2 ..., and their units; from the rows above the samples."""
    row = _names_row(rows, width) or []
    stated = next((each for each in rows if each and each[0] == UNIT), [])
    names: list[str] = []
    units: list[str] = []
    groups = 0
    for place, cell in enumerate(row):
        if cell == NAME:
            groups += 1
            names.append(TIME if groups == 1 else f"{TIME}:{groups}")
            units.append("ms")
        else:
            names.append(cell)
            unit = stated[place] if place < len(stated) else ""
            units.append(unit if unit_of(unit) is not None else "")
    return names, units


def one_clock(table: ForeignTable) -> ForeignTable:
    """The channels of all groups on one clock: as they stand where the groups' times agree, else interpolated.

    Raises InputError: the groups have no time in common.
    """
    groups: list[list[ForeignColumn]] = []
    for column in table.columns:
        if column.name == TIME or column.name.startswith(f"{TIME}:"):
            groups.append([])
        if groups and column.numbers is not None:
            groups[-1].append(column)
    groups = [group for group in groups if len(group) > 1]
    if not groups:
        raise InputError(f"{table.path}: an export of TwinCAT Scope without a channel of numbers")
    tables = []
    for group in groups:
        kept = np.isfinite(np.stack([np.asarray(column.numbers, dtype=np.float64) for column in group])).all(
            axis=0
        )
        named = [
            replace(column, name=TIME if place == 0 else column.name, numbers=column.numbers[kept], wrong={})  # type: ignore[index]
            for place, column in enumerate(group)
        ]
        tables.append(ForeignTable(table.path, tuple(named)))
    first = tables[0].columns[0].numbers
    if all(np.array_equal(each.columns[0].numbers, first) for each in tables):  # type: ignore[arg-type]
        columns = tables[0].columns + tuple(column for each in tables[1:] for column in each.columns[1:])
        return ForeignTable(table.path, columns, {}, table.remarks, time=TIME)
    smooth = [column.name for each in tables for column in each.columns]
    joined = join_on_time(tables, [TIME] * len(tables), None, smooth)
    columns = tuple(
        replace(column, name=TIME) if column.name == JOINED_TIME else column for column in joined.columns
    )
    remarks = (*table.remarks, "groups of channels have times of their own: " + joined.remarks[-1])
    return ForeignTable(table.path, columns, {}, remarks, time=TIME)
