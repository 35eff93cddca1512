"""MAT files of any version, and plain HDF5 files, as named variables."""

from __future__ import annotations

import zlib
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from identify.recording.errors import InputError
from identify.recording.foreign.table import ForeignColumn, ForeignTable
from identify.recording.units import split_name

NOT_MAT = (
    ValueError,
    TypeError,
    LookupError,
    NotImplementedError,
    EOFError,
    OverflowError,
    MemoryError,
    zlib.error,
)
"""What the reader of MAT files raises, beside its own error, on files that are none or are damaged."""


def read_mat(path: Path) -> ForeignTable:
    """Read a MAT file of version 4 to 7.

    :raises InputError: it is damaged or holds no column of numbers.
    """
    from scipy.io import loadmat
    from scipy.io.matlab import MatReadError

    try:
        content = loadmat(path, squeeze_me=False, struct_as_record=False)
        found = dict(_numeric({name: value for name, value in content.items() if not name.startswith("__")}))
    except (MatReadError, *NOT_MAT) as error:
        raise InputError(f"{path}: cannot be read as a MAT file: {' '.join(str(error).split())}") from None
    return table_of_variables(path, found)


def _numeric(variables: Mapping[str, Any], prefix: str = "") -> Iterator[tuple[str, NDArray[Any]]]:
    """Numeric arrays by name; the fields of a struct as struct.field."""
    for name, value in variables.items():
        if isinstance(value, np.ndarray):
            if value.dtype.kind in "biuf":
                yield prefix + name, value
            elif value.dtype == object and value.size == 1:
                yield from _numeric({name: value.reshape(-1)[0]}, prefix)
        elif hasattr(value, "_fieldnames"):
            fields = {field: getattr(value, field) for field in value._fieldnames}
            yield from _numeric(fields, f"{prefix}{name}.")


def read_hdf5(path: Path) -> ForeignTable:
    """Read a MAT file of version 7.3, or any HDF5 file; MATLAB stores variables transposed.

    :raises InputError: it is damaged or holds no column of numbers.
    """
    import h5py

    found: dict[str, NDArray[Any]] = {}

    def take(name: str, item: Any) -> None:
        if isinstance(item, h5py.Dataset) and item.dtype.kind in "biuf" and not name.startswith("#"):
            found[name.replace("/", ".")] = item[()].T

    try:
        with h5py.File(path, "r") as file:
            file.visititems(take)
    except (OSError, RuntimeError, *NOT_MAT) as error:
        raise InputError(f"{path}: cannot be read as HDF5: {' '.join(str(error).split())}") from None
    return table_of_variables(path, found)


def table_of_variables(path: Path, variables: Mapping[str, NDArray[Any]]) -> ForeignTable:
    """Arrays by name as columns: a column of a two-dimensional one is NAME:K, K from 1; single numbers are scalars.

    :raises InputError: none of them is a column.
    """
    columns: list[ForeignColumn] = []
    scalars: dict[str, float] = {}
    for name, values in variables.items():
        if values.size == 1:
            scalars[name] = float(values.reshape(()))
        elif values.ndim == 1 or (values.ndim == 2 and min(values.shape) == 1):
            columns.append(_column(name, values.reshape(-1)))
        elif values.ndim == 2 and min(values.shape) > 0:
            tall = values if values.shape[0] >= values.shape[1] else values.T
            columns += [_column(f"{name}:{k + 1}", tall[:, k]) for k in range(tall.shape[1])]
    if not columns:
        raise InputError(f"{path}: holds no column of numbers")
    return ForeignTable(path, tuple(columns), scalars)


def _column(name: str, values: NDArray[Any]) -> ForeignColumn:
    unit = split_name(name)[1]
    whole = values.dtype.kind in "iu" and values.dtype.itemsize == 8
    numbers = values.astype(np.int64) if whole else values.astype(np.float64)
    return ForeignColumn(name, numbers, None, unit, "the name" if unit else "")
