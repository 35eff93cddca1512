"""A session in CSV: read as a stream, checked cell by cell, a wrong line named by its number."""

from __future__ import annotations

import gzip
import re
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from identify.recording.csv_mistakes import LARGEST_VALUE, check_header, first_mistake, is_gzip
from identify.recording.errors import InputError
from identify.recording.plain_text import header_cell
from identify.recording.samples import RawSamples, SampleColumns

Array = NDArray[np.float64]

BLOCK_BYTES = 512 << 10
"""Text parsed at a time; bounds the memory whatever the size of the file. Measured on six joints: a tenth less processor
time than with 4 MB, whose columns leave the cache and whose memory the kernel clears anew for every block."""
ROWS_WRITTEN = 1 << 16
"""Rows written at a time."""


def read_csv_session(path: Path, n: int) -> RawSamples:
    """Read a session of n joints from a CSV file, plain or gzip.

    Raises InputError: the file cannot be read, or a column or a cell is wrong; names file, column and line.
    """
    header = check_header(path, n)
    texts: set[str] = set()
    while True:
        try:
            return _read(path, n, header, texts)
        except _NotNumeric as error:
            texts |= error.columns


class _NotNumeric(Exception):
    """Extra columns that hold something else than numbers."""

    def __init__(self, columns: set[str]) -> None:
        super().__init__()
        self.columns = columns


def _read(path: Path, n: int, header: list[str], texts: set[str]) -> RawSamples:
    import pyarrow
    from pyarrow import csv

    groups = _groups(header, n)
    known = {name for names in groups.values() for name in names}
    extra = [name for name in header if name not in known]
    types = {name: pyarrow.string() if name in texts else pyarrow.float64() for name in header}
    stores = {kind: SampleColumns(0 if kind == "t" else n) for kind in groups}
    extras = {name: SampleColumns() for name in extra if name not in texts}
    cells: dict[str, list[NDArray[Any]]] = {name: [] for name in texts}
    last = -np.inf
    # Arrow opens the file itself. Its thread reads ahead, and given a Python file object it may still ask for the
    # interpreter when that is ending: the process then aborts (134) after all is done.
    packed = is_gzip(path)
    try:
        with (
            pyarrow.input_stream(str(path), compression="gzip" if packed else None) as stream,
            csv.open_csv(
                stream,
                read_options=csv.ReadOptions(
                    use_threads=False, block_size=BLOCK_BYTES, column_names=header, skip_rows=1
                ),
                convert_options=csv.ConvertOptions(
                    column_types=types, null_values=[""], strings_can_be_null=False
                ),
            ) as reader,
        ):
            for batch in reader:
                columns = dict(zip(header, batch.columns, strict=True))
                if any(columns[name].null_count for name in known):
                    raise _mistake(path, header, known)
                for kind, names in groups.items():
                    values = np.empty((batch.num_rows, len(names)))
                    for index, name in enumerate(names):
                        values[:, index] = _as_numpy(columns[name])
                    if not (np.abs(values) <= LARGEST_VALUE).all():  # nor where a value is not a number
                        raise _mistake(path, header, known)
                    if kind == "t":
                        values = values[:, 0]
                        if not (np.diff(values, prepend=last) > 0).all():
                            raise _mistake(path, header, known)
                        last = values[-1]
                    stores[kind].append(values)
                for name, store in extras.items():
                    store.append(_as_numpy(columns[name]))
                for name, parts in cells.items():
                    coded = columns[name].dictionary_encode()  # equal texts are one object
                    known_texts = np.array(coded.dictionary.to_pylist(), dtype=object)
                    parts.append(known_texts[_as_numpy(coded.indices)])
    except pyarrow.ArrowInvalid as error:
        wrong = first_mistake(path, header, known)
        failing = _failing_columns(str(error), header) & set(extra) - texts
        if wrong is None and failing:
            raise _NotNumeric(failing) from None
        raise wrong or InputError(f"{path}: {' '.join(str(error).split())}") from None
    except OSError as error:
        if packed:
            raise InputError(f"{path}: the gzip file is damaged or cut short; copy it again") from None
        raise InputError(f"{path}: cannot be read: {error.strerror or error}") from None
    read = {kind: store.array() for kind, store in stores.items()}
    if len(read["t"]) == 0:
        raise InputError(f"{path}: holds a header and no samples")
    others: dict[str, NDArray[Any]] = {name: store.array() for name, store in extras.items()}
    others |= {name: np.concatenate(parts) for name, parts in cells.items()}
    return RawSamples(
        read["t"],
        read["q"],
        read["v"],
        read.get("ext"),
        read.get("temp"),
        {name: others[name] for name in extra},
    )


def _as_numpy(column: Any) -> NDArray[Any]:
    """The numbers of an Arrow array, NaN where one is missing.

    Not by `to_numpy` or `fill_null`, which import pandas where it is installed: a third of the time of a whole
    `identify`. The layout is Arrow's: a bit for each valid number (none where all are), then the numbers.
    """
    if not column.null_count:
        return np.from_dlpack(column)
    valid, numbers = column.buffers()
    rows = slice(column.offset, column.offset + len(column))
    values = np.frombuffer(numbers, np.float64)[rows].copy()
    values[np.unpackbits(np.frombuffer(valid, np.uint8), bitorder="little")[rows] == 0] = np.nan
    return values


def _failing_columns(message: str, header: list[str]) -> set[str]:
    """The column that the reader could not turn into numbers; all of them if it does not say."""
    numbered = re.search(r"CSV column #(\d+)", message)
    return {header[int(numbered[1])]} if numbered else set(header)


def _mistake(path: Path, header: list[str], known: set[str]) -> InputError:
    return first_mistake(path, header, known) or InputError(f"{path}: not a CSV file of numbers")


def _groups(header: Sequence[str], n: int) -> dict[str, list[str]]:
    groups = {"t": ["t"]}
    for kind in ("q", "v", "ext", "temp"):
        names = [f"{kind}{joint}" for joint in range(1, n + 1)]
        if names[0] in header:
            groups[kind] = names
    return groups


def write_csv_session(
    path: Path,
    time: Array,
    position: Array,
    command: Array,
    external: Array | None = None,
    temperature: Array | None = None,
    extra: Mapping[str, ArrayLike] | None = None,
) -> None:
    """Write a session by the contract: t, q1 ... qn, v1 ... vn and what else is given; gzip if the name
    ends in .gz.

    time  : (N,) s
    position, command, external, temperature : (N, n), or (N,) for one joint
    extra : name -> (N,); a name becomes one that no spreadsheet takes for a formula

    Numbers are written so that reading them gives the same float64 again.
    """
    import pyarrow
    from pyarrow import csv

    columns: dict[str, NDArray[Any]] = {"t": np.asarray(time, dtype=float)}
    for kind, values in (("q", position), ("v", command), ("ext", external), ("temp", temperature)):
        if values is not None:
            table = np.asarray(values, dtype=float).reshape(len(time), -1)
            columns |= {f"{kind}{joint + 1}": table[:, joint] for joint in range(table.shape[1])}
    columns |= {name: np.asarray(values) for name, values in (extra or {}).items()}
    opener = gzip.open if path.name.lower().endswith(".gz") else open
    plain = csv.WriteOptions(include_header=False)
    with opener(path, "wb") as stream:
        stream.write((",".join(header_cell(name) for name in columns) + "\n").encode())
        for first in range(0, len(time), ROWS_WRITTEN):
            rows = [pyarrow.array(values[first : first + ROWS_WRITTEN]) for values in columns.values()]
            csv.write_csv(pyarrow.table(rows, names=list(columns)), stream, plain)
