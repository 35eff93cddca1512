"""Measurements in other people's files: CSV of any dialect and MAT files, as named columns.

A column is named as in the file. One column of a two-dimensional variable is NAME:K, K from 1; of a CSV
file without a header, columns are numbered from 1.
"""

from __future__ import annotations

import csv
import gzip
import io
import zlib
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from identify.recording.csv_mistakes import unpacked
from identify.recording.errors import InputError

Array = NDArray[np.float64]

DIALECTS = (",", ";", "\t", " ")
"""Delimiters that are told from the first line."""


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


@dataclass(frozen=True)
class ForeignTable:
    """What a foreign file holds."""

    path: Path
    columns: dict[str, Array]
    """name -> (N,), not all of one length"""
    scalars: dict[str, float]
    """name -> number; a gain that the file itself states, for example"""

    def column(self, name: str, used_for: str) -> Array:
        """The column of a name.

        :raises InputError: there is none; names those that are there.
        """
        if name in self.columns:
            return self.columns[name]
        several = [found for found in self.columns if found.startswith(f"{name}:")]
        if several:
            raise InputError(
                f"{self.path}: '{name}' has {len(several)} columns; say which for {used_for}, {several[0]} for example"
            )
        raise InputError(f"{self.path}: there is no column '{name}' for {used_for}; there are {self.names()}")

    def names(self) -> str:
        """The columns in one line."""
        shown = list(self.columns)[:40]
        return ", ".join(shown) + (" ..." if len(self.columns) > len(shown) else "")


def read_foreign(path: Path) -> ForeignTable:
    """Read a CSV (plain or gzip) or MAT file (any version).

    :raises InputError: the file cannot be read or holds no column of numbers.
    """
    if not path.is_file():
        raise InputError(f"{path}: there is no such file")
    try:
        with path.open("rb") as stream:
            start = stream.read(520)
        if start.startswith((b"MATLAB 7.3", b"\x89HDF")):
            variables = _variables_of_hdf5(path)
        elif path.suffix.lower() == ".mat" or start.startswith(b"MATLAB"):
            variables = _variables_of_mat(path)
        else:
            variables = _columns_of_csv(path)
    except OSError as error:
        raise InputError(f"{path}: cannot be read: {error.strerror or error}") from None
    columns: dict[str, Array] = {}
    scalars: dict[str, float] = {}
    for name, values in variables.items():
        if values.size == 1:
            scalars[name] = float(values.reshape(()))
        elif values.ndim == 1 or min(values.shape) == 1:
            columns[name] = values.reshape(-1).astype(float)
        elif values.ndim == 2:
            tall = values if values.shape[0] >= values.shape[1] else values.T
            columns |= {f"{name}:{k + 1}": tall[:, k].astype(float) for k in range(tall.shape[1])}
    if not columns:
        raise InputError(f"{path}: holds no column of numbers")
    return ForeignTable(path, columns, scalars)


def _variables_of_mat(path: Path) -> dict[str, NDArray[Any]]:
    from scipy.io import loadmat
    from scipy.io.matlab import MatReadError

    try:
        content = loadmat(path, squeeze_me=False, struct_as_record=False)
    except (MatReadError, *NOT_MAT) as error:
        raise InputError(f"{path}: cannot be read as a MAT file: {' '.join(str(error).split())}") from None
    return dict(_numeric({name: value for name, value in content.items() if not name.startswith("__")}))


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


def _variables_of_hdf5(path: Path) -> dict[str, NDArray[Any]]:
    """Variables of a MAT file of version 7.3, or of any HDF5 file; MATLAB stores them transposed."""
    import h5py

    found: dict[str, NDArray[Any]] = {}

    def take(name: str, item: Any) -> None:
        if isinstance(item, h5py.Dataset) and item.dtype.kind in "biuf" and not name.startswith("#"):
            found[name.replace("/", ".")] = item[()].T

    with h5py.File(path, "r") as file:
        file.visititems(take)
    return found


def _columns_of_csv(path: Path) -> dict[str, NDArray[Any]]:
    try:
        with unpacked(path) as stream:
            text = io.TextIOWrapper(stream, encoding="utf-8-sig", newline="").read()
    except UnicodeDecodeError:
        raise InputError(
            f"{path}: is neither a MAT file nor text in UTF-8; export it as CSV in UTF-8"
        ) from None
    except (EOFError, zlib.error, gzip.BadGzipFile) as error:
        raise InputError(f"{path}: the gzip file is damaged or cut short ({error}); copy it again") from None
    first = text.lstrip().split("\n", 1)[0]
    delimiter = max(DIALECTS, key=lambda sign: (first.count(sign) > 0, -DIALECTS.index(sign)))
    if delimiter == "," and first.count(";") > 0:
        delimiter = ";"
    rows = [
        row
        for row in csv.reader(io.StringIO(text), delimiter=delimiter, skipinitialspace=True)
        if any(cell.strip() for cell in row)
    ]
    if not rows:
        raise InputError(f"{path}: is empty")
    decimal = "," if delimiter == ";" and "." not in text else "."
    names = [cell.strip() for cell in rows[0]]
    if all(_number(cell, decimal) is not None for cell in names if cell):
        names = [str(index + 1) for index in range(len(names))]
    else:
        rows = rows[1:]
    found: dict[str, NDArray[Any]] = {}
    for index, name in enumerate(names):
        cells = [_number(row[index], decimal) if index < len(row) else None for row in rows]
        # A column of words is not for us; a single cell of words among numbers is told when the column is
        # asked for.
        if name and len(cells) > 1 and sum(cell is None for cell in cells) <= len(cells) // 2:
            found[name] = np.array([np.nan if cell is None else cell for cell in cells])
    return found


def _number(cell: str, decimal: str) -> float | None:
    try:
        return float(cell.replace(",", ".") if decimal == "," else cell)
    except ValueError:
        return None
