"""A session in CSV: read as a stream, checked cell by cell, a wrong line named by its number."""

from __future__ import annotations

import gzip
import zlib
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import IO, Any

import numpy as np
from numpy.typing import NDArray

from identify.recording.csv_mistakes import check_header, first_mistake
from identify.recording.errors import InputError
from identify.recording.samples import SampleColumns

Array = NDArray[np.float64]

BLOCK_BYTES = 4 << 20
"""Text parsed at a time; bounds the memory whatever the size of the file."""


@dataclass
class RawSamples:
    """The columns of a session as they stand in its file: time not yet uniform, holes not yet found."""

    time: Array
    """(N,) s"""
    position: Array
    """(N, n) rad or m"""
    command: Array
    """(N, n) unit of the drive gain"""
    external: Array | None = None
    """(N, n) N m or N"""
    temperature: Array | None = None
    """(N, n) degC"""
    extra: dict[str, NDArray[Any]] = field(default_factory=dict)
    """name -> (N,)"""
    remarks: list[str] = field(default_factory=list)


def read_csv_session(path: Path, n: int) -> RawSamples:
    """Read a session of n joints from a CSV file, plain or gzip.

    :raises InputError: the file cannot be read, or a column or a cell is wrong; names file, column and line.
    """
    header = check_header(path, n)
    try:
        return _read(path, n, header, text_columns=False)
    except _NotNumeric:
        return _read(path, n, header, text_columns=True)


class _NotNumeric(Exception):
    """An extra column holds something else than numbers."""


def open_text(path: Path) -> IO[bytes]:
    """The bytes of a file, unpacked if it is gzip (told by its first bytes, whatever its name)."""
    with path.open("rb") as stream:
        packed = stream.read(2) == b"\x1f\x8b"
    return gzip.open(path, "rb") if packed else path.open("rb")  # type: ignore[return-value]


def _read(path: Path, n: int, header: list[str], text_columns: bool) -> RawSamples:
    import pyarrow
    from pyarrow import csv

    groups = _groups(header, n)
    known = {name for names in groups.values() for name in names}
    extra = [name for name in header if name not in known]
    text = pyarrow.string() if text_columns else pyarrow.float64()
    types = {name: pyarrow.float64() for name in known} | dict.fromkeys(extra, text)
    stores = {kind: SampleColumns(0 if kind == "t" else n) for kind in groups}
    extras: dict[str, SampleColumns] = {name: SampleColumns() for name in extra} if not text_columns else {}
    texts: dict[str, list[str]] = {name: [] for name in extra} if text_columns else {}
    last = -np.inf
    try:
        with (
            open_text(path) as stream,
            csv.open_csv(
                stream,
                read_options=csv.ReadOptions(use_threads=False, block_size=BLOCK_BYTES),
                convert_options=csv.ConvertOptions(
                    column_types=types, null_values=[""], strings_can_be_null=False, include_columns=header
                ),
            ) as reader,
        ):
            for batch in reader:
                columns = dict(zip(header, batch.columns, strict=True))
                if any(columns[name].null_count for name in known):
                    raise first_mistake(path, header, known)
                for kind, names in groups.items():
                    values = np.empty((batch.num_rows, len(names)))
                    for index, name in enumerate(names):
                        values[:, index] = columns[name].to_numpy(zero_copy_only=False)
                    if not np.isfinite(values).all():
                        raise first_mistake(path, header, known)
                    if kind == "t":
                        values = values[:, 0]
                        if not (np.diff(values, prepend=last) > 0).all():
                            raise first_mistake(path, header, known)
                        last = values[-1]
                    stores[kind].append(values)
                for name, store in extras.items():
                    store.append(columns[name].to_numpy(zero_copy_only=False))
                for name, cells in texts.items():
                    cells.extend(columns[name].to_pylist())
    except pyarrow.ArrowInvalid as error:
        mistake = first_mistake(path, header, known)
        if mistake is None and not text_columns:
            raise _NotNumeric from None
        raise mistake or InputError(f"{path}: {error}") from None
    except (EOFError, zlib.error, gzip.BadGzipFile) as error:
        raise InputError(f"{path}: the gzip file is damaged or cut short ({error}); copy it again") from None
    except OSError as error:
        raise InputError(f"{path}: cannot be read: {error.strerror or error}") from None
    read = {kind: store.array() for kind, store in stores.items()}
    if len(read["t"]) == 0:
        raise InputError(f"{path}: holds a header and no samples")
    return RawSamples(
        read["t"],
        read["q"],
        read["v"],
        read.get("ext"),
        read.get("temp"),
        {name: store.array() for name, store in extras.items()}
        | {name: as_numbers(cells) for name, cells in texts.items()},
    )


def _groups(header: Sequence[str], n: int) -> dict[str, list[str]]:
    groups = {"t": ["t"]}
    for kind in ("q", "v", "ext", "temp"):
        names = [f"{kind}{joint}" for joint in range(1, n + 1)]
        if names[0] in header:
            groups[kind] = names
    return groups


def as_numbers(cells: list[str]) -> NDArray[Any]:
    """Cells of an extra column as numbers where all are (empty: NaN), as texts otherwise."""
    try:
        return np.array([float(cell) if cell else np.nan for cell in cells])
    except ValueError:
        return np.array(cells, dtype=object)


def write_csv_session(
    path: Path,
    time: Array,
    position: Array,
    command: Array,
    external: Array | None = None,
    temperature: Array | None = None,
    extra: dict[str, Iterable[Any]] | None = None,
) -> None:
    """Write a session by the contract: t, q1 ... qn, v1 ... vn and what else is given; gzip if the name
    ends in .gz.

    time : (N,) s; position, command, external, temperature : (N, n), or (N,) for one joint; extra : name ->
    (N,) Numbers are written so that reading them gives the same float64 again.
    """
    columns: dict[str, Iterable[Any]] = {"t": np.asarray(time, dtype=float)}
    groups = (("q", position), ("v", command), ("ext", external), ("temp", temperature))
    for kind, values in groups:
        if values is not None:
            table = np.asarray(values, dtype=float).reshape(len(time), -1)
            columns |= {f"{kind}{joint + 1}": table[:, joint] for joint in range(table.shape[1])}
    columns |= extra or {}
    texts = [
        [cell if isinstance(cell, str) else repr(float(cell)) for cell in values]
        for values in columns.values()
    ]
    opener = gzip.open if path.name.endswith(".gz") else open
    with opener(path, "wt", encoding="utf-8", newline="") as stream:  # type: ignore[operator]
        stream.write(",".join(columns) + "\n")
        stream.writelines(",".join(row) + "\n" for row in zip(*texts, strict=True))
