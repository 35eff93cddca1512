"""Channels of measurement data files (ASAM MDF 3 and 4: .mf4, .mdf, .dat), read by the package asammdf.

A file holds groups of channels, each with a time of its own. They are joined on time, as several files of a session are.
"""

from __future__ import annotations

import gc
import logging
import sys
from collections import Counter
from collections.abc import Iterator
from contextlib import contextmanager
from importlib import import_module
from pathlib import Path
from typing import Any

import numpy as np

from identify.recording.errors import InputError
from identify.recording.foreign.joining import join_on_time
from identify.recording.foreign.table import ForeignColumn, ForeignTable
from identify.recording.units import split_name, unit_of

TIME = "time"
SMOOTH = ("angle", "length")
"""Quantities that are interpolated by cubics where groups are joined: positions."""


def is_mdf(start: bytes) -> bool:
    """Whether a file is one, by its first bytes; UnFinMF is one whose recorder did not end it."""
    return start.startswith((b"MDF ", b"UnFinMF "))


def read_mdf(path: Path) -> ForeignTable:
    """Read the channels of a file.

    Groups of one rate are columns side by side; of several, all are put on the stamps of the fastest. Samples that are
    marked invalid are NaN.

    Raises InputError: it is damaged, holds no channels of numbers, or the package that reads it is not installed.
    """
    try:
        asammdf = import_module("asammdf")
    except ImportError:
        raise InputError(f"{path}: measurement data files need asammdf: pip install 'coulomb[mdf]'") from None
    logging.getLogger("asammdf").setLevel(
        logging.CRITICAL
    )  # it tells of a damaged file on stderr, and raises as well
    with _disposed_of_quietly():
        tables, passed, whole = _read(path, asammdf)
    if not whole:
        raise InputError(
            f"{path}: cannot be read as a measurement data file: damaged, cut short, or with channels that asammdf does"
            " not know; copy or export it again"
        )
    if not tables:
        raise InputError(
            f"{path}: holds no channels of numbers"
            + (f" ({'; '.join(passed)}); of frames on a CAN bus give a log, with --rig" if passed else "")
        )
    return _joined(path, tables, passed)


def _read(path: Path, asammdf: Any) -> tuple[list[ForeignTable], list[str], bool]:
    """Tables, what was passed over, and whether the file can be read."""
    try:
        with asammdf.MDF(path) as file:
            return *_tables(path, file), True
    except Exception:  # asammdf has errors of its own, and Python's on damaged files
        return [], [], False


@contextmanager
def _disposed_of_quietly() -> Iterator[None]:
    """Objects of a reader that failed half way fail again when they are disposed of, which Python tells on stderr."""
    hook = sys.unraisablehook
    sys.unraisablehook = lambda _unraisable: None
    try:
        yield
        gc.collect()
    finally:
        sys.unraisablehook = hook


def _tables(path: Path, file: Any) -> tuple[list[ForeignTable], list[str]]:
    """One table for each group with samples, and what was passed over."""
    start = int(file.start_time.timestamp() * 1e6) * 1000 if file.start_time is not None else 0
    tables: list[ForeignTable] = []
    passed: list[str] = []
    for number, group in enumerate(file.groups):
        columns: list[ForeignColumn] = []
        stamps = np.zeros(0)
        for place in range(len(group.channels)):
            if place == file.masters_db.get(number):
                continue
            signal = file.get(group=number, index=place, ignore_invalidation_bits=True)
            values = np.asarray(signal.samples)
            if values.ndim != 1 or values.dtype.names:
                passed.append(f"{signal.name} is no single number")
                continue
            stamps = np.asarray(signal.timestamps, dtype=np.float64)
            columns.append(_column(signal, values))
        if columns and len(stamps):
            times = start + np.round(stamps * 1e9).astype(np.int64)
            clock = ForeignColumn(TIME, times, None, None, "", absolute=True)
            # a group's own name, or its number, tells columns of one name apart where groups are joined
            name = str(getattr(group.channel_group, "acq_name", "") or f"group{number + 1}")
            tables.append(ForeignTable(path.with_name(f"{name}{path.suffix}"), (clock, *columns), time=TIME))
    return tables, passed


def _column(signal: Any, values: np.ndarray) -> ForeignColumn:
    if values.dtype.kind in "SU":
        texts = [each.decode("utf-8", "replace") if isinstance(each, bytes) else str(each) for each in values]
        return ForeignColumn(signal.name, None, texts)
    unit, source = unit_of(signal.unit) if signal.unit else None, "the channel"
    if unit is None:
        unit, source = split_name(signal.name)[1], "the name"
    invalid = signal.invalidation_bits
    if invalid is not None and np.any(invalid):
        numbers = np.where(np.asarray(invalid, dtype=bool), np.nan, values.astype(np.float64))
    elif values.dtype.kind in "iub" and values.dtype != np.uint64:
        numbers = values.astype(np.int64)
    else:
        numbers = values.astype(np.float64)
    return ForeignColumn(signal.name, numbers, None, unit, source if unit else "")


def _joined(path: Path, tables: list[ForeignTable], passed: list[str]) -> ForeignTable:
    remarks = [f"passed over: {'; '.join(passed[:5])}{' ...' if len(passed) > 5 else ''}"] if passed else []
    first = tables[0].columns[0].numbers
    if all(np.array_equal(table.columns[0].numbers, first) for table in tables):  # type: ignore[arg-type]
        count = Counter(column.name for table in tables for column in table.columns[1:])
        columns = [tables[0].columns[0]]
        for table in tables:
            for column in table.columns[1:]:
                name = column.name if count[column.name] == 1 else f"{table.path.stem}:{column.name}"
                columns.append(
                    ForeignColumn(name, column.numbers, column.words, column.unit, column.unit_source)
                )
        return ForeignTable(path, tuple(columns), {}, tuple(remarks), time=TIME)
    smooth = [
        column.name
        for table in tables
        for column in table.columns
        if column.unit is not None and column.unit.quantity in SMOOTH
    ]
    try:
        joined = join_on_time(tables, [TIME] * len(tables), None, smooth)
    except InputError:
        longest = max(tables, key=lambda table: len(table.columns[0]))
        others = ", ".join(table.path.stem for table in tables if table is not longest)
        remarks.append(
            f"the groups have too little time in common: read is {longest.path.stem}, passed over {others}"
        )
        return ForeignTable(path, longest.columns, {}, tuple(remarks), time=TIME)
    return ForeignTable(path, joined.columns, {}, (*remarks, *joined.remarks), time=joined.time)
