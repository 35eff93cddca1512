"""Columns of Parquet files."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np

from identify.recording.errors import InputError
from identify.recording.foreign.table import ForeignColumn, ForeignTable
from identify.recording.units import Unit, split_name, unit_of


def read_parquet(path: Path) -> ForeignTable:
    """Read a Parquet file; a field's metadata `unit` or the name states its unit.

    Fields of a structure are called NAME.FIELD; a column of lists of one length becomes NAME:1, NAME:2 ...

    Raises InputError: it is damaged or holds no column of numbers.
    """
    import pyarrow
    from pyarrow import parquet, types

    try:
        content = parquet.read_table(path)
    except (pyarrow.ArrowException, OSError):
        raise InputError(
            f"{path}: cannot be read as Parquet: damaged or cut short; write or copy it again"
        ) from None
    while any(types.is_struct(kind) for kind in content.schema.types):
        content = content.flatten()
    columns: list[ForeignColumn] = []
    passed: list[str] = []
    for schema, values in zip(content.schema, content.columns, strict=True):
        stated = (schema.metadata or {}).get(b"unit", b"").decode("utf-8", "replace")
        unit, source = (
            (unit_of(stated), "the field's metadata") if stated else (split_name(schema.name)[1], "the name")
        )
        read = _column(schema.name, values, unit, source)
        if not read:
            read = _columns_of_lists(schema.name, values, unit, source)
        columns += read
        passed += [] if read else [f"{schema.name} ({values.type})"]
    if all(column.numbers is None for column in columns):
        raise InputError(f"{path}: holds no column of numbers")
    remarks = (f"columns of another type passed over: {', '.join(passed[:10])}",) if passed else ()
    return ForeignTable(path, tuple(columns), {}, remarks)


def _column(name: str, values: Any, unit: Unit | None, source: str) -> list[ForeignColumn]:
    """A column of Arrow as one of ours; empty for a type that is neither number, time nor word."""
    import pyarrow
    from pyarrow import types

    kind = values.type
    if types.is_dictionary(kind):
        values, kind = values.cast(kind.value_type), kind.value_type
    if types.is_timestamp(kind) or types.is_date(kind):
        stamps = _counted(values.cast(pyarrow.timestamp("ns"), safe=False))
        return [ForeignColumn(name, stamps, None, None, "", absolute=True)]
    if types.is_duration(kind):
        spans = _counted(values.cast(pyarrow.duration("ns"), safe=False))
        return [ForeignColumn(name, spans, None, unit_of("ns"), "the field's type")]
    if types.is_integer(kind) and values.null_count == 0 and kind.bit_width == 64:
        return [ForeignColumn(name, _counted(values), None, unit, source if unit else "")]
    if types.is_floating(kind) or types.is_integer(kind) or types.is_boolean(kind) or types.is_decimal(kind):
        numbers = values.cast(pyarrow.float64(), safe=False).to_numpy()
        return [
            ForeignColumn(name, np.asarray(numbers, dtype=np.float64), None, unit, source if unit else "")
        ]
    if types.is_string(kind) or types.is_large_string(kind) or types.is_string_view(kind):
        return [ForeignColumn(name, None, ["" if cell is None else cell for cell in values.to_pylist()])]
    return []


def _counted(values: Any) -> Any:
    """(N,) counts of a column of 64 bits; as float with NaN where some are missing."""
    import pyarrow

    counts = values.cast(pyarrow.int64(), safe=False).to_numpy()
    return counts if counts.dtype.kind == "f" else counts.astype(np.int64)


def _columns_of_lists(name: str, values: Any, unit: Unit | None, source: str) -> list[ForeignColumn]:
    """A column of lists of numbers, all of one length, as so many columns; else none."""
    import pyarrow
    from pyarrow import compute, types

    kind = values.type
    if not (types.is_list(kind) or types.is_large_list(kind) or types.is_fixed_size_list(kind)):
        return []
    inner = kind.value_type
    if not (types.is_floating(inner) or types.is_integer(inner)) or values.null_count:
        return []
    lengths = np.unique(compute.call_function("list_value_length", [values]).to_numpy())
    if len(lengths) != 1 or not lengths[0]:
        return []
    flat = compute.call_function("list_flatten", [values]).cast(pyarrow.float64(), safe=False).to_numpy()
    return [
        ForeignColumn(f"{name}:{place + 1}", each, None, unit, source if unit else "")
        for place, each in enumerate(np.asarray(flat, dtype=np.float64).reshape(-1, int(lengths[0])).T)
    ]
