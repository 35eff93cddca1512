"""A text file of unknown encoding as lines: byte order marks, UTF-8, UTF-16, Windows-1252, any line end."""

from __future__ import annotations

import codecs
import gzip
import io
import zlib
from collections import deque
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import IO

from identify.recording.csv_mistakes import LONGEST_LINE, unpacked
from identify.recording.errors import InputError

MARKS = (
    (codecs.BOM_UTF8, "utf-8-sig", "UTF-8 with a byte order mark"),
    (codecs.BOM_UTF32_LE, "utf-32", "UTF-32"),
    (codecs.BOM_UTF32_BE, "utf-32", "UTF-32"),
    (codecs.BOM_UTF16_LE, "utf-16", "UTF-16"),
    (codecs.BOM_UTF16_BE, "utf-16", "UTF-16"),
)
"""Byte order mark, codec, words."""
LOOKED_AT = 1000
"""Lines at the begin and at the end of a file that its dialect is told from."""


@dataclass(frozen=True)
class TextFile:
    """A file's lines, its encoding known."""

    path: Path
    encoding: str
    said: str
    """The encoding in words; "" for plain UTF-8."""
    head: list[str]
    """The first lines, without their ends."""
    tail: list[str]
    """The last lines that are not in `head`."""
    count: int
    """Lines in all."""
    ended: bool = True
    """Whether the last line has an end."""

    def lines(self) -> Iterator[str]:
        """All lines, without their ends."""
        with _opened(self.path, self.encoding) as text:
            yield from map(_plain, _bounded(text, self.path))


def open_text(path: Path) -> TextFile:
    """Find out how a file is encoded and look at its begin and end.

    Raises InputError: it is not text, or is damaged.
    """
    try:
        with unpacked(path) as stream:
            start = stream.read(4096)
        for encoding, description in _candidates(start):
            try:
                return _looked_at(path, encoding, description)
            except UnicodeDecodeError:
                continue
    except (EOFError, zlib.error, gzip.BadGzipFile) as error:
        raise InputError(f"{path}: the gzip file is damaged or cut short ({error}); copy it again") from None
    except UnicodeError:
        pass
    raise InputError(f"{path}: is neither text nor a kind of file that is known; export it as CSV in UTF-8")


def _candidates(start: bytes) -> list[tuple[str, str]]:
    for mark, encoding, description in MARKS:
        if start.startswith(mark):
            return [(encoding, description)]
    even, odd = start[0::2].count(0), start[1::2].count(0)
    if max(even, odd) > len(start) // 6:
        return [("utf-16-be", "UTF-16")] if even > odd else [("utf-16-le", "UTF-16")]
    return [("utf-8", ""), ("cp1252", "Windows-1252"), ("latin-1", "Latin-1")]


def _looked_at(path: Path, encoding: str, description: str) -> TextFile:
    head: list[str] = []
    tail: deque[str] = deque(maxlen=LOOKED_AT)
    count, last = 0, "\n"
    with _opened(path, encoding) as text:
        for last in _bounded(text, path):
            (head if count < LOOKED_AT else tail).append(_plain(last))
            count += 1
    shown = "".join(head[:50])
    control = sum(sign < " " and sign not in "\t\x0b\x0c\x1a" for sign in shown)
    if control > 2 or "\x00" in shown:
        raise InputError(
            f"{path}: is neither text nor a kind of file that is known; export it as CSV in UTF-8"
        )
    return TextFile(path, encoding, description, head, list(tail), count, last.endswith(("\n", "\x1a")))


@contextmanager
def _opened(path: Path, encoding: str) -> Iterator[IO[str]]:
    with unpacked(path) as stream, io.TextIOWrapper(stream, encoding=encoding, newline=None) as text:
        yield text


def _bounded(text: IO[str], path: Path) -> Iterator[str]:
    for number, line in enumerate(iter(lambda: text.readline(LONGEST_LINE), ""), start=1):
        if len(line) == LONGEST_LINE and not line.endswith("\n"):
            raise InputError(
                f"{path} line {number}: longer than {LONGEST_LINE} characters; not a table of samples"
            )
        yield line


def _plain(line: str) -> str:
    return line.rstrip("\n").rstrip("\x1a")
