"""What is wrong with a CSV file, said with the line and column where it is wrong.

The fast reader only knows that something is wrong; this slow one reads line by line until it can say what.
"""

from __future__ import annotations

import csv
import gzip
import io
import math
import re
import zlib
from collections.abc import Collection, Generator, Iterator
from contextlib import closing, contextmanager
from pathlib import Path
from typing import IO

from identify.recording.errors import InputError
from identify.recording.plain_text import LONGEST_QUOTE, quoted

LARGEST_VALUE = 1e12
"""Nothing that a drive or a sensor says is larger, in whatever unit."""
LONGEST_LINE = 1 << 20
"""Characters."""
SEPARATORS = {";": "';'", "\t": "tabs", " ": "spaces"}
"""What stands between columns where it should be a comma, in words."""

_INDEXED = re.compile(r"^(q|v|ext|temp)([0-9]+)$")


def is_gzip(path: Path) -> bool:
    """Whether a file is gzip, told by its first bytes, whatever its name.

    Raises OSError: it cannot be opened.
    """
    with path.open("rb") as stream:
        return stream.read(2) == b"\x1f\x8b"


@contextmanager
def unpacked(path: Path) -> Iterator[IO[bytes]]:
    """The bytes of a file, unpacked if it is gzip (told by its first bytes, whatever its name)."""
    opener = gzip.open if is_gzip(path) else open
    with opener(path, "rb") as stream:
        yield stream  # type: ignore[misc]


def _lines(path: Path) -> Generator[list[str], None, None]:
    """The rows of a CSV file as lists of cells, with InputError for what stops the reading."""
    try:
        with unpacked(path) as stream, io.TextIOWrapper(stream, encoding="utf-8-sig", newline="") as text:
            rows = csv.reader(_bounded(text, path))
            whole = 0
            try:
                for row in rows:
                    whole = rows.line_num
                    yield row
            except csv.Error as error:
                raise InputError(
                    f"{path} line {whole + 1}: cannot be split into cells ({error}); is a quote left open?"
                ) from None
    except UnicodeDecodeError:
        raise InputError(f"{path}: not text in UTF-8; export it as CSV in UTF-8") from None
    except (EOFError, zlib.error, gzip.BadGzipFile) as error:
        raise InputError(f"{path}: the gzip file is damaged or cut short ({error}); copy it again") from None
    except FileNotFoundError:
        raise InputError(f"{path}: there is no such file") from None
    except OSError as error:
        raise InputError(f"{path}: cannot be read: {error.strerror or error}") from None


def _bounded(text: IO[str], path: Path) -> Iterator[str]:
    """The lines of a text; a file without an end of line is not read into memory.

    Raises InputError: a line is longer than any row of a table.
    """
    for number, line in enumerate(iter(lambda: text.readline(LONGEST_LINE), ""), start=1):
        if len(line) == LONGEST_LINE and not line.endswith(("\n", "\r")):
            raise InputError(
                f"{path} line {number}: longer than {LONGEST_LINE} characters; not a CSV file of samples"
            )
        yield line


def check_header(path: Path, n: int) -> list[str]:
    """The column names of a session of n joints, in the order of the file.

    Raises InputError: the file cannot be read, is empty, or a column is missing, doubled or one too many.
    """
    with closing(_lines(path)) as lines:
        header = next(lines, None)
    if header is None or not any(cell.strip() for cell in header):
        raise InputError(f"{path}: is empty; the first line must name the columns: {', '.join(needed(n))}")
    separator = next((sign for sign in SEPARATORS if len(header) == 1 and sign in header[0].strip()), None)
    if separator:
        raise InputError(
            f"{path} line 1: columns are separated by {SEPARATORS[separator]}; separate them by ',' and write decimals"
            " with '.', or use 'coulomb import'"
        )
    header = [cell.strip() for cell in header]
    for index, name in enumerate(header):
        if not name:
            raise InputError(f"{path} line 1: column {index + 1} has no name")
        if name in header[:index]:
            raise InputError(f"{path} line 1: column '{name}' occurs twice; keep one")
    missing = [name for name in needed(n) if name not in header]
    if missing:
        raise InputError(
            f"{path} line 1: column{'s' if len(missing) > 1 else ''} {', '.join(missing)} missing;"
            f" a session of {n} joint{'s' if n > 1 else ''} needs {', '.join(needed(n))}"
        )
    for name in header:
        indexed = _INDEXED.match(name)
        if indexed and not 1 <= int(indexed[2]) <= n:
            raise InputError(
                f"{path} line 1: column '{name}', but the experiment declares {n} joint{'s' if n > 1 else ''}"
            )
    for kind in ("ext", "temp"):
        present = [f"{kind}{joint}" in header for joint in range(1, n + 1)]
        if any(present) and not all(present):
            absent = f"{kind}{present.index(False) + 1}"
            raise InputError(
                f"{path} line 1: column '{absent}' missing; give {kind}1 ... {kind}{n}, or none of them"
            )
    return header


def needed(n: int) -> list[str]:
    """The columns that a session of n joints must have: t, q1 ... qn, v1 ... vn (contract, section 1)."""
    return ["t", *(f"{kind}{joint}" for kind in "qv" for joint in range(1, n + 1))]


def first_mistake(path: Path, header: list[str], numeric: Collection[str]) -> InputError | None:
    """The first wrong line, in words; None if every line has its cells and every numeric cell is a number."""
    places = [(index, name) for index, name in enumerate(header) if name in numeric]
    at_time = header.index("t")
    last: str | None = None
    try:
        with closing(_lines(path)) as lines:
            for number, cells in enumerate(lines, start=1):
                if number == 1 or not cells:
                    continue
                mistake = _wrong_cell(cells, header, places)
                if mistake is None and last is not None and float(cells[at_time]) <= float(last):
                    mistake = f"column 't': {cells[at_time]} does not come after {last}; time must increase"
                if mistake is not None:
                    return InputError(f"{path} line {number}: {mistake}")
                last = cells[at_time]
    except InputError as error:
        return error
    return None


def _wrong_cell(cells: list[str], header: list[str], places: list[tuple[int, str]]) -> str | None:
    if len(cells) != len(header):
        hint = "; write decimals with '.'" if len(cells) == 2 * len(header) else ""
        return f"{len(cells)} cells, but the header names {len(header)} columns{hint}"
    for index, name in places:
        value = _number(cells[index])
        if value is None or not math.isfinite(value):
            shown = quoted(cells[index]) if cells[index].strip() else "an empty cell"
            return f"column '{name}': {shown} is not a finite number"
        if abs(value) > LARGEST_VALUE:
            return f"column '{name}': {cells[index].strip()[:LONGEST_QUOTE]} is no measured value (beyond {LARGEST_VALUE:g})"
    return None


def _number(cell: str) -> float | None:
    """The cell as a number, if it is written as one in CSV (Python alone would also take 1_000)."""
    try:
        return None if "_" in cell else float(cell)
    except ValueError:
        return None
