"""Columns of Parquet files."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from identify.recording.errors import InputError
from identify.recording.foreign.table import ForeignColumn, ForeignTable
from identify.recording.units import split_name, unit_of


def read_parquet(path: Path) -> ForeignTable:
    """Read a Parquet file; a field's metadata `unit` or the name states its unit.

    Raises InputError: it is damaged or holds no column of numbers.
    """
    import pyarrow
    from pyarrow import parquet, types

    try:
        content = parquet.read_table(path)
    except (pyarrow.ArrowException, OSError) as error:
        raise InputError(f"{path}: cannot be read as Parquet: {' '.join(str(error).split())[:200]}") from None
    columns: list[ForeignColumn] = []
    for name, schema in zip(content.column_names, content.schema, strict=True):
        values = content.column(name)
        stated = (schema.metadata or {}).get(b"unit", b"").decode("utf-8", "replace")
        unit, source = (
            (unit_of(stated), "the field's metadata") if stated else (split_name(name)[1], "the name")
        )
        kind = values.type
        if types.is_timestamp(kind) or types.is_date(kind):
            stamps = values.cast(pyarrow.timestamp("ns"), safe=False).cast(pyarrow.int64()).to_numpy()
            columns.append(ForeignColumn(name, stamps.astype(np.int64), None, None, "", absolute=True))
        elif types.is_duration(kind):
            spans = values.cast(pyarrow.duration("ns"), safe=False).cast(pyarrow.int64()).to_numpy()
            columns.append(
                ForeignColumn(name, spans.astype(np.int64), None, unit_of("ns"), "the field's type")
            )
        elif types.is_integer(kind) and values.null_count == 0 and kind.bit_width == 64:
            columns.append(
                ForeignColumn(name, values.cast(pyarrow.int64(), safe=False).to_numpy(), None, unit, source)
            )
        elif (
            types.is_floating(kind)
            or types.is_integer(kind)
            or types.is_boolean(kind)
            or types.is_decimal(kind)
        ):
            numbers = values.cast(pyarrow.float64(), safe=False).to_numpy()
            columns.append(
                ForeignColumn(name, np.asarray(numbers, dtype=np.float64), None, unit, source if unit else "")
            )
        elif types.is_string(kind) or types.is_large_string(kind) or types.is_dictionary(kind):
            columns.append(
                ForeignColumn(name, None, ["" if cell is None else str(cell) for cell in values.to_pylist()])
            )
    if all(column.numbers is None for column in columns):
        raise InputError(f"{path}: holds no column of numbers")
    return ForeignTable(path, tuple(columns))
