"""One table out of several files of one session, joined on time: positions in one, currents in another."""

from __future__ import annotations

from collections import Counter
from collections.abc import Collection, Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from identify.recording.errors import InputError
from identify.recording.foreign.instants import NANOSECOND
from identify.recording.foreign.repair import (
    Repair,
    refuse_coarse_clock,
    refuse_other_unit,
    repaired_stamps,
)
from identify.recording.foreign.roles import ColumnMap
from identify.recording.foreign.table import Clock, ForeignColumn, ForeignTable
from identify.recording.interpolation import interpolate
from identify.recording.sampling import SHORTEST_SEGMENT, largest_bridged_step
from identify.recording.units import Unit

Array = NDArray[np.float64]

JOINED_TIME = "joined time"
"""Name of the time column of a joined table."""


def join_session(
    tables: Sequence[ForeignTable], times: Sequence[str], columns: ColumnMap, repair: Repair | None = None
) -> tuple[ForeignTable, ColumnMap]:
    """One table out of the files of one session, and where its columns stand: `columns` with the joined time.

    times : the time column of each file, or one that all have; none: those of `columns`

    Raises InputError: as many times as files are needed; or as `join_on_time`.
    """
    given = list(times) or list(columns.joined) or ([columns.time] if columns.time else [])
    if not given:
        raise InputError("--time: is missing; files are joined on their time columns")
    if len(given) not in (1, len(tables)):
        raise InputError(f"--time: {len(given)} given for {len(tables)} files; give one, or {len(tables)}")
    of_each = given * (len(tables) // len(given))
    unit = columns.time_unit or columns.joined_unit
    joined = join_on_time(tables, of_each, unit, columns.position, repair)
    return joined, replace(columns, time=joined.time, time_unit=None, joined=tuple(of_each), joined_unit=unit)


def join_on_time(
    tables: Sequence[ForeignTable],
    times: Sequence[str],
    time_unit: str | None,
    smooth: Collection[str],
    repair: Repair | None = None,
) -> ForeignTable:
    """Put the columns of several files on the time stamps of the one that was sampled fastest.

    times  : the time column of each file
    smooth : names of columns that are interpolated by cubics (positions); others by straight lines

    Only the time that all files cover is kept, and nothing is interpolated across a hole. A column whose name stands in
    several files is called FILE:NAME, FILE without its ending.

    Raises InputError: the files have no time in common, or their clocks cannot be compared.
    """
    clocks = [table.clock(name, time_unit) for table, name in zip(tables, times, strict=True)]
    _refuse_different_clocks(tables, clocks)
    remarks = [f"{table.path.name}: {remark}" for table in tables for remark in table.remarks]
    remarks += [f"{table.path.name}: {clock.said}" for table, clock in zip(tables, clocks, strict=True)]
    origin = min(clock.begin or 0 for clock in clocks)
    stamps: list[Array] = []
    rows: list[NDArray[np.intp]] = []
    for table, clock, name in zip(tables, clocks, times, strict=True):
        seconds = clock.seconds + ((clock.begin or 0) - origin) * NANOSECOND
        refuse_coarse_clock(seconds, clock, f"{table.path}: column '{name}'", repair)
        if not (np.diff(seconds) > 0).all():
            if repair is None or not np.isfinite(seconds).all():
                raise InputError(
                    f"{table.path}: column '{name}': time does not increase; --repair drop leaves such samples out"
                )
            seconds, kept, repairs = repaired_stamps(seconds, repair)
            remarks += [f"{table.path.name}: {repair_remark}" for repair_remark in repairs]
        else:
            kept = np.arange(len(seconds))
        if len(seconds) < SHORTEST_SEGMENT:
            raise InputError(f"{table.path}: {len(seconds)} samples; that is too few for a session")
        refuse_other_unit(seconds, f"{table.path}: column '{name}'")
        stamps.append(seconds)
        rows.append(kept)
    begin, end = max(each[0] for each in stamps), min(each[-1] for each in stamps)
    within = [(each >= begin) & (each <= end) for each in stamps]
    base = max(range(len(tables)), key=lambda index: int(within[index].sum()))
    at = stamps[base][within[base]]
    if len(at) < SHORTEST_SEGMENT:
        spans = "; ".join(
            f"{table.path.name} {each[0]:.6g} to {each[-1]:.6g} s"
            for table, each in zip(tables, stamps, strict=True)
        )
        raise InputError(f"{tables[0].path}: the files have too little time in common to join them: {spans}")
    usable = np.ones(len(at), dtype=bool)
    for each in stamps:
        usable &= _covered(each, at)
    at = at[usable]
    taken = _unique_names(tables)
    columns = [ForeignColumn(JOINED_TIME, at, None, Unit("s", "time", 1.0), "joining")]
    for index, table in enumerate(tables):
        for column, name in zip(table.columns, taken[index], strict=True):
            if (
                column.numbers is None
                or len(column.numbers) != len(clocks[index].seconds)
                or column.name == times[index]
            ):
                continue
            values = column.numbers[rows[index]].astype(np.float64)[:, None]
            cubic = bool({name, column.name, column.base_name} & set(smooth))
            new = interpolate(stamps[index], values, at, cubic)[:, 0]
            columns.append(ForeignColumn(name, new, None, column.unit, column.unit_source))
    same = all(
        len(each[mask]) >= len(at) and np.isin(at, each).all()
        for each, mask in zip(stamps, within, strict=True)
    )
    how = "at common stamps" if same else "interpolated to its stamps"
    remarks.append(
        f"joined on time: {len(at)} samples of {tables[base].path.name}, the others {how}; {end - begin:.6g} s in common"
    )
    if not usable.all():
        remarks.append(f"{int((~usable).sum())} samples in holes of another file left out")
    return ForeignTable(tables[0].path, tuple(columns), {}, tuple(remarks), time=JOINED_TIME)


def _refuse_different_clocks(tables: Sequence[ForeignTable], clocks: Sequence[Clock]) -> None:
    kinds = [
        "times of day" if clock.of_day else "dates" if clock.begin is not None else "seconds"
        for clock in clocks
    ]
    for table, kind in zip(tables, kinds, strict=True):
        if kind != kinds[0]:
            raise InputError(
                f"{table.path}: its time column states {kind}, that of {tables[0].path.name} {kinds[0]}; they cannot be"
                " joined"
            )


def _covered(stamps: Array, at: Array) -> NDArray[np.bool_]:
    """Whether an instant lies between samples that are no hole apart."""
    longest = largest_bridged_step(float(np.median(np.diff(stamps))))
    right = np.clip(np.searchsorted(stamps, at, side="left"), 1, len(stamps) - 1)
    exact = stamps[np.clip(np.searchsorted(stamps, at), 0, len(stamps) - 1)] == at
    return exact | (stamps[right] - stamps[right - 1] <= longest)


def _unique_names(tables: Sequence[ForeignTable]) -> list[list[str]]:
    count = Counter(name for table in tables for name in {column.name for column in table.columns})
    return [
        [
            f"{table.path.stem}:{column.name}" if count[column.name] > 1 else column.name
            for column in table.columns
        ]
        for table in tables
    ]
