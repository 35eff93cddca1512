"""Logs of CAN frames as frames, whatever wrote them: told by the lines themselves, then by the file's name.

Text is read here where a line speaks for itself: can-utils (candump -L, and what candump shows with -ta, -tA, -tz or -td),
BUSMASTER, Kvaser CanKing, SavvyCAN. Vector's ASC and BLF, PEAK's TRC and python-can's own CSV are read by python-can, with text
made absolute or newer first where it does not do that. Layouts as read off public readers and logs.
"""

from __future__ import annotations

import codecs
import gzip
import io
import itertools
import logging
import re
import struct
import tempfile
import zlib
from collections.abc import Generator, Iterable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from drivers import can
from drivers.frames import ERROR, FD, REMOTE
from identify.recording.csv_mistakes import unpacked
from identify.recording.errors import InputError
from identify.recording.foreign.instants import parse_instants

CLASSIC_DATA = 8
BLF_OBJECT, BLF_HEADER = b"LOBJ", 16
"""Mark of an object in a BLF file, and bytes of the shortest header; bytes 8 to 11 say how long it is."""
LOOKED_AT = 200
"""Lines that the kind of a log is told from."""
LATEST = 4.2e9
"""s; a later time, of the year 2103, is a damaged one (and some beyond would not fit into 64 bits of ns)."""
MOST_WARNINGS = 100_000
"""Lines or objects that cannot be read, beyond one for every byte of a log, at which it counts as damaged from there on."""
ERROR_BIT = 0x2000_0000
"""Of an id of candump: a frame that tells of an error on the bus."""

_COLOURS = re.compile(r"\x1b\[[0-9;]*m")
_BYTES = r"(?P<data>(?:[0-9A-Fa-f]{2}\s+)*(?:[0-9A-Fa-f]{2})?)"


@dataclass(frozen=True)
class Layout:
    """How one tool writes a frame into a line."""

    name: str
    line: re.Pattern[str]
    """With the groups time, id, data, and of channel, extended, remote those that there are."""
    of_day: bool = False
    """Whether times are dates or times of day, not numbers."""
    long_is_extended: bool = False
    """Whether an id of eight digits is a long one, by its digits alone."""
    second: float = 1.0
    """Counts of the time in a second."""


LAYOUTS = (
    Layout(
        "candump -L",
        re.compile(
            r"^\s*\((?P<time>\d{1,10}\.\d{1,12})\)\s+(?P<channel>\S+)\s+(?P<id>[0-9A-Fa-f]{3}|[0-9A-Fa-f]{8})#(?P<fd>#[0-9A-Fa-f])?"
            r"(?:(?P<remote>R[0-9A-Fa-f]?)|(?P<data>(?:[0-9A-Fa-f]{2}\.?)*))(?:\s+[RT])?\s*$"
        ),
        long_is_extended=True,
    ),
    Layout(
        "candump -tA",
        re.compile(
            r"^\s*\((?P<time>\d{4}-\d\d-\d\d[ T]\d\d:\d\d:\d\d\.\d+)\)\s+(?P<channel>\S+)\s+(?:[RT]X\s+\S+\s+\S+\s+)?"
            r"(?P<id>[0-9A-Fa-f]{3}|[0-9A-Fa-f]{8})\s+\[\d+\]\s+(?:(?P<remote>remote request)|"
            + _BYTES
            + r")\s*(?:'.*|ERRORFRAME.*)?$"
        ),
        of_day=True,
        long_is_extended=True,
    ),
    Layout(
        "candump",
        re.compile(
            r"^\s*(?:\((?P<time>\d{1,10}\.\d{1,12})\)\s+)?(?P<channel>[A-Za-z]\S*)\s+(?:[RT]X\s+\S+\s+\S+\s+)?"
            r"(?P<id>[0-9A-Fa-f]{3}|[0-9A-Fa-f]{8})\s+\[\d+\]\s+(?:(?P<remote>remote request)|"
            + _BYTES
            + r")\s*(?:'.*|ERRORFRAME.*)?$"
        ),
        long_is_extended=True,
    ),
    Layout(
        "BUSMASTER",
        re.compile(
            r"^(?P<time>\d{1,3}:\d\d:\d\d:\d{1,4})\s+[RT]x\s+(?P<channel>\d+)\s+0x(?P<id>[0-9A-Fa-f]{1,8})\s+(?P<extended>x|xr|s|sr)\s+\d+\s*"
            + _BYTES
            + r"\s*$"
        ),
        of_day=True,
    ),
    Layout(
        "Kvaser CanKing",
        re.compile(
            r"^\s*(?P<channel>\d+)\s+(?P<id>[0-9A-Fa-f]{3,8})\s+(?:(?P<extended>[A-Z]+)\s+)?\d{1,2}\s+"
            + _BYTES
            + r"\s+(?P<time>\d{1,10}\.\d{1,12})\s+[RT]\s*$"
        ),
    ),
    Layout(
        "SavvyCAN",
        re.compile(
            r"^(?P<time>\d{1,16}),(?P<id>[0-9A-Fa-f]{1,8}),(?P<extended>true|false),(?:[RT]x,)?(?P<channel>\d+),\d+,"
            r"(?P<data>(?:[0-9A-Fa-f]{2},?)*),*\s*$"
        ),
        second=1e6,
    ),
)


@dataclass(frozen=True)
class LoggedFrame:
    """One frame of a log."""

    channel: str
    stamp: int
    """ns, on the log's clock"""
    can_id: int
    extended: bool
    flags: int
    """Of `drivers.frames`: REMOTE, ERROR, FD."""
    data: bytes
    """At most 8"""


def read_frames(path: Path) -> tuple[list[LoggedFrame], list[str]]:
    """All frames of a log in its order, and what was decided, in words.

    Raises InputError: it cannot be read, or its lines have no times.
    """
    try:
        if not path.stat().st_size:
            raise InputError(f"{path}: is empty")
        lines = _lines(path)
        layout = _layout_of(itertools.islice(lines, LOOKED_AT))
        if layout is not None:
            return _by_lines(path, layout)
        return _by_python_can(path)
    except (EOFError, zlib.error, gzip.BadGzipFile):
        raise InputError(f"{path}: the gzip file is damaged or cut short; copy it again") from None
    except OSError as error:
        raise InputError(f"{path}: cannot be read: {error.strerror or error}") from None


def _lines(path: Path) -> Iterator[str]:
    with unpacked(path) as stream:
        encoding = "utf-16" if stream.read(2) in (codecs.BOM_UTF16_LE, codecs.BOM_UTF16_BE) else "utf-8"
    with unpacked(path) as stream, io.TextIOWrapper(stream, encoding=encoding, errors="replace") as text:
        for line in text:
            yield _COLOURS.sub("", line)


def _layout_of(lines: Iterable[str]) -> Layout | None:
    """The layout that most lines with anything like a frame have; None where hardly any line has one."""
    shown = [line for line in lines if line.strip() and not line.startswith(("*", ";", "//"))]
    matching = {layout: sum(bool(layout.line.match(line)) for line in shown) for layout in LAYOUTS}
    best = max(LAYOUTS, key=lambda layout: matching[layout])
    return best if matching[best] and 2 * matching[best] >= len(shown) - 1 else None


def _by_lines(path: Path, layout: Layout) -> tuple[list[LoggedFrame], list[str]]:
    frames: list[re.Match[str]] = []
    damaged = 0
    relative = False
    for line in _lines(path):
        match = layout.line.match(line)
        if match is not None:
            frames.append(match)
        elif line.startswith("*"):
            relative |= "RELATIVE MODE" in line
        elif frames and line.strip():
            damaged += 1
    if any(match["time"] is None for match in frames):
        raise InputError(f"{path}: its lines have no times; record with candump -L (or -ta)")
    stamps, kept = _stamps([match["time"] for match in frames], layout)
    damaged += len(frames) - len(kept)
    frames = [frames[place] for place in kept]
    remarks = [f"lines as of {layout.name}"]
    steps = np.diff(stamps)
    if relative or (not layout.of_day and 10 * int((steps < 0).sum()) > len(steps)):
        stamps = np.cumsum(stamps)
        remarks = [f"lines as of {layout.name}, each time counted from the frame before"]
    remarks += _passed_over(damaged)
    return [
        _frame(match, stamp, layout) for match, stamp in zip(frames, stamps.tolist(), strict=True)
    ], remarks


def _passed_over(damaged: int) -> list[str]:
    lines = f"{damaged} line{'s' if damaged > 1 else ''}"
    return [f"{lines} without a whole frame passed over"] if damaged else []


def _stamps(texts: list[str], layout: Layout) -> tuple[NDArray[np.int64], list[int]]:
    """(M,) ns, and the places of the texts that are times."""
    kept = list(range(len(texts)))
    if not layout.of_day:
        seconds = [float(text) / layout.second for text in texts]
        kept = [place for place in kept if seconds[place] < LATEST]
        return np.array([round(seconds[place] * 1e9) for place in kept], dtype=np.int64), kept
    while True:
        parsed = parse_instants([texts[place] for place in kept])
        if not isinstance(parsed, int):
            return parsed[0], kept
        del kept[parsed]  # a 45th of a month


def _frame(match: re.Match[str], stamp: int, layout: Layout) -> LoggedFrame:
    groups = match.groupdict()
    identifier = int(groups["id"], 16)
    marked = groups.get("extended")
    extended = marked in ("x", "xr", "true") or bool(marked and "X" in marked)
    extended |= layout.long_is_extended and len(groups["id"]) == 8
    flags = REMOTE if groups.get("remote") or marked in ("sr", "xr") else 0
    flags |= FD if groups.get("fd") else 0
    if extended and identifier & ERROR_BIT:
        flags |= ERROR
    written = (groups["data"] or "").replace(" ", "").replace(".", "").replace(",", "")
    return LoggedFrame(
        groups.get("channel") or "",
        stamp,
        identifier,
        extended,
        flags,
        bytes.fromhex("".join(written.split()))[:CLASSIC_DATA],
    )


def _by_python_can(path: Path) -> tuple[list[LoggedFrame], list[str]]:
    frames: list[LoggedFrame] = []
    remarks: list[str] = []
    warnings = _Counted(MOST_WARNINGS + path.stat().st_size)
    kind = Path(path.name.removesuffix(".gz")).suffix.lower()
    try:
        with (
            _told_to(warnings),
            tempfile.TemporaryDirectory() as folder,
            _reader(_rewritten(path, Path(folder))) as reader,
        ):
            for message in reader:
                if not abs(message.timestamp) < LATEST:
                    continue
                flags = (REMOTE if message.is_remote_frame else 0) | (ERROR if message.is_error_frame else 0)
                flags |= FD if message.is_fd else 0
                frames.append(
                    LoggedFrame(
                        str(message.channel),
                        round(message.timestamp * 1e9),
                        message.arbitration_id,
                        message.is_extended_id,
                        flags,
                        bytes(message.data)[:CLASSIC_DATA],
                    )
                )
    except OSError:
        raise
    except Exception:  # readers let through whatever a damaged line or block raises in them
        if not frames:
            known = ", ".join(layout.name for layout in LAYOUTS[3:])
            raise InputError(
                f"{path}: cannot be read as a {kind} log of CAN frames; is it damaged or cut short? Logs are those of candump,"
                f" {known}, Vector (.asc, .blf) and PEAK (.trc)"
            ) from None
        seconds = (frames[-1].stamp - frames[0].stamp) * 1e-9
        remarks.append(f"the log is damaged or cut short after {seconds:.6g} s: read up to there")
    return frames, [*_passed_over(warnings.count), *remarks]


class _Counted(logging.Handler):
    """Counts what is logged, up to `most`; of more the reading ends."""

    def __init__(self, most: int) -> None:
        super().__init__(logging.WARNING)
        self._most = most
        self.count = 0

    def emit(self, record: logging.LogRecord) -> None:
        """Count one record."""
        if self.count == self._most:
            raise ValueError("almost no line can be read")
        self.count += 1


@contextmanager
def _told_to(handler: _Counted) -> Generator[None]:
    """What python-can warns of, a line that it cannot read for one, is counted instead of shown."""
    logger = logging.getLogger("can")
    passed_on, logger.propagate = logger.propagate, False
    logger.addHandler(handler)
    try:
        yield
    finally:
        logger.removeHandler(handler)
        logger.propagate = passed_on


class _BlfReader(can.BLFReader):
    """python-can's reader, which goes round and round at an object that says it has no length."""

    def _parse_data(self, data: bytes) -> Iterator[can.Message]:
        at = 0
        while (at := data.find(BLF_OBJECT, at, at + 8)) >= 0 and at + BLF_HEADER <= len(data):
            (size,) = struct.unpack_from("<I", data, at + 8)
            if size < BLF_HEADER:
                raise ValueError("an object without a length")
            at += size
        yield from super()._parse_data(data)


def _reader(path: Path) -> Any:
    return _BlfReader(path) if path.suffix.lower() == ".blf" else can.LogReader(path)


def _rewritten(path: Path, folder: Path) -> Path:
    """The log itself, or a copy in words that python-can reads, under the name of its kind."""
    with unpacked(path) as stream:
        start = stream.read(4096)
    suffix = Path(path.name.removesuffix(".gz")).suffix.lower()
    text = start.decode("utf-8", "replace")
    if re.search(r"^;\$FILEVERSION=", text, re.MULTILINE):
        suffix = ".trc"
    elif re.search(r"^base\s+(?:hex|dec)", text, re.MULTILINE | re.IGNORECASE):
        suffix = ".asc"
    elif start.startswith(b"LOGG"):
        suffix = ".blf"
    target = folder / f"log{suffix}"
    if suffix == ".asc":
        _write(target, _absolute(_lines(path)))
    elif suffix == ".trc":
        _write(target, _newer_trc(_lines(path)))
    elif suffix == path.suffix or (path.suffix.lower() == ".gz" and suffix != ".blf"):
        return path
    else:
        with unpacked(path) as stream:
            target.write_bytes(stream.read())
    return target


def _write(path: Path, lines: Iterable[str]) -> None:
    with path.open("w", encoding="utf-8", newline="") as file:
        file.writelines(lines)


_ASC_EVENT = re.compile(r"^\s*(\d+\.\d+)(\s+\S.*)$", re.DOTALL)


def _absolute(lines: Iterable[str]) -> Iterator[str]:
    """Lines of an ASC log with times since its begin, where it states that each counts from the event before."""
    relative, total = False, 0.0
    for line in lines:
        if line.lower().startswith("base"):
            relative = "relative" in line.lower()
            line = line.replace("relative", "absolute")
        event = _ASC_EVENT.match(line) if relative else None
        if event is not None:
            total += float(event[1])
            line = f"{total:.9f}{event[2]}"
        yield line


_TRC_1_2 = re.compile(r"^(\s*\d+\)\s+\S+\s+\d+\s+\S+\s+[0-9A-Fa-f]+)(\s+\d+\s)")


def _newer_trc(lines: Iterable[str]) -> Iterator[str]:
    """Lines of a TRC log, those of version 1.2 with the column of version 1.3 that it lacks."""
    older = False
    for line in lines:
        if line.startswith(";$FILEVERSION=1.2"):
            older, line = True, line.replace("1.2", "1.3")
        yield _TRC_1_2.sub(r"\1  -\2", line) if older and not line.startswith(";") else line
