"""Ring buffer in shared memory: structured rows, one writer, many readers, an overrun is never silent.

The segment is a file in /dev/shm mapped by each process. `multiprocessing.shared_memory` is not used: in
Python 3.11 a process that merely attaches registers the segment with its resource tracker, which unlinks it
when that process exits, under everyone else's feet.

The rule of the ring. Rows are counted from 0 for the ring's whole life; row i lives in slot i mod capacity.

    writer: reserved = n + k; write the k rows; head = n + k
    reader: read head; copy; read reserved; drop the rows before reserved - capacity

A slot is being overwritten only while its row lies before `reserved - capacity`, so whatever the reader
keeps was whole while it was copied. Reading `head` alone accepts torn rows.
"""

import fcntl
import json
import mmap
import os
import platform
import secrets
import tempfile
import threading
import time
from pathlib import Path
from types import TracebackType
from typing import Any, Self

import numpy as np
from numpy.typing import NDArray

_FOLDER = Path("/dev/shm") if Path("/dev/shm").is_dir() else Path(tempfile.gettempdir())
_PREFIX = "coulomb-ring-"
_MAGIC = 0x474E4952_4C554F43  # "COULRING"
_HEADER_BYTES = 4096
_DESCRIPTION_OFFSET = 1024

# Indices of the header's 64-bit words. Each of the counters that different processes touch has a cache line
# of its own (eight words), so that a reader's publishing does not slow the writer.
_WORD_MAGIC, _WORD_CAPACITY, _WORD_DESCRIPTION_BYTES = 0, 1, 2
_WORD_RESERVED, _WORD_HEAD, _WORD_CLOSED, _WORD_WRITER = 8, 16, 24, 25
_WORD_CONSUMED = 32

_STRONGLY_ORDERED = platform.machine().lower() in ("x86_64", "amd64", "i686", "i386")
_held = threading.Lock()
_held.acquire()


def _fence() -> None:
    """Keep memory accesses before and after in order.

    x86 never reorders two stores or two loads, which is all that the ring's rule needs. Elsewhere (ARM) a
    release followed by an acquisition of a lock is the barrier that Python offers.
    """
    if not _STRONGLY_ORDERED:
        _held.release()
        _held.acquire()


class RingOverrun(Exception):
    """The writer overwrote rows that this reader had not read yet.

    `lost` is how many; reading goes on behind them with the next call.
    """

    def __init__(self, lost: int, first: int) -> None:
        super().__init__(f"{lost} rows from row {first} on were overwritten before they were read")
        self.lost = lost
        self.first = first


class _Segment:
    """The mapped file, its header and its rows."""

    def __init__(self, path: Path, mapped: mmap.mmap, descriptor: int) -> None:
        self.path = path
        self._mapped = mapped
        self._descriptor = descriptor
        self._words: NDArray[np.int64] = np.frombuffer(mapped, np.int64, _DESCRIPTION_OFFSET // 8)
        if self._words[_WORD_MAGIC] != _MAGIC:
            raise FileNotFoundError(f"{path} is no ring, or not one yet")
        self.capacity = int(self._words[_WORD_CAPACITY])
        length = int(self._words[_WORD_DESCRIPTION_BYTES])
        description = json.loads(mapped[_DESCRIPTION_OFFSET : _DESCRIPTION_OFFSET + length])
        self.dtype = _dtype_from_description(description)
        # Rows as bytes without fields: copying structured rows goes field by field and takes ten times as long.
        self._bytes = np.dtype((np.void, self.dtype.itemsize))
        self._rows: NDArray[Any] = np.frombuffer(mapped, self._bytes, self.capacity, _HEADER_BYTES)

    @property
    def name(self) -> str:
        """What a reader passes to `RingReader` to attach."""
        return self.path.name.removeprefix(_PREFIX)

    @property
    def head(self) -> int:
        """Rows written so far."""
        return int(self._words[_WORD_HEAD])

    def close(self) -> None:
        """Unmap. Rows that were handed out are copies, so nothing dangles."""
        if self._mapped.closed:
            return
        # NumPy's views export the buffer; they must be gone before mmap lets go of it.
        del self._words, self._rows
        self._mapped.close()
        os.close(self._descriptor)

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        self.close()


class RingWriter(_Segment):
    """The one writer. Creates the segment.

    dtype : structured type of a row
    capacity : rows that fit before the oldest is overwritten
    name : letters that a reader attaches by; chosen at random when left out
    """

    def __init__(self, dtype: np.dtype[Any], capacity: int, name: str | None = None) -> None:
        if capacity < 1:
            raise ValueError("a ring needs a capacity of at least one row")
        remove_abandoned_rings()
        path = _FOLDER / f"{_PREFIX}{name or secrets.token_hex(8)}"
        description = json.dumps(_description_of_dtype(dtype)).encode()
        if len(description) > _HEADER_BYTES - _DESCRIPTION_OFFSET:
            raise ValueError("the row's type has too many fields for the ring's header")
        descriptor = os.open(path, os.O_RDWR | os.O_CREAT | os.O_EXCL, 0o600)
        try:
            fcntl.flock(descriptor, fcntl.LOCK_SH)
            size = _HEADER_BYTES + capacity * dtype.itemsize
            # posix_fallocate and not ftruncate: a full /dev/shm is an error here, not a SIGBUS during motion.
            os.posix_fallocate(descriptor, 0, size)
            mapped = mmap.mmap(descriptor, size)
        except OSError:
            os.close(descriptor)
            path.unlink()
            raise
        mapped[_DESCRIPTION_OFFSET : _DESCRIPTION_OFFSET + len(description)] = description
        header = np.frombuffer(mapped, np.int64, _DESCRIPTION_OFFSET // 8)
        header[_WORD_CAPACITY] = capacity
        header[_WORD_DESCRIPTION_BYTES] = len(description)
        header[_WORD_WRITER] = os.getpid()
        header[_WORD_MAGIC] = _MAGIC
        del header
        super().__init__(path, mapped, descriptor)

    def write(self, rows: NDArray[Any]) -> None:
        """Append rows (k,) of the ring's dtype; never waits."""
        if rows.dtype != self.dtype:
            raise ValueError(f"the ring holds rows of {self.dtype}, not of {rows.dtype}")
        rows = np.ascontiguousarray(rows).view(self._bytes)
        for start in range(0, len(rows), self.capacity):
            self._write_block(rows[start : start + self.capacity])

    def _write_block(self, rows: NDArray[Any]) -> None:
        head = int(self._words[_WORD_HEAD])
        end = head + len(rows)
        self._words[_WORD_RESERVED] = end
        _fence()
        slot = head % self.capacity
        until_wrap = min(len(rows), self.capacity - slot)
        self._rows[slot : slot + until_wrap] = rows[:until_wrap]
        self._rows[: len(rows) - until_wrap] = rows[until_wrap:]
        _fence()
        self._words[_WORD_HEAD] = end

    @property
    def room(self) -> int:
        """Rows that can be written before one is overwritten that the recorder has not taken.

        Only a writer that may wait (simulated time) looks at this.
        """
        return self.capacity - (self.head - int(self._words[_WORD_CONSUMED]))

    def finish(self) -> None:
        """Tell the readers that no row will follow."""
        _fence()
        self._words[_WORD_CLOSED] = 1

    def unlink(self) -> None:
        """Remove the name. Readers that are attached keep their mapping."""
        self.path.unlink(missing_ok=True)


class RingReader(_Segment):
    """A reader attached to a ring by name, beginning at the oldest row that is still there.

    Raises FileNotFoundError when there is no such ring.
    """

    def __init__(self, name: str) -> None:
        path = _FOLDER / f"{_PREFIX}{name}"
        descriptor = os.open(path, os.O_RDWR)
        try:
            fcntl.flock(descriptor, fcntl.LOCK_SH)
            mapped = mmap.mmap(descriptor, 0)
        except (OSError, ValueError):
            os.close(descriptor)
            raise
        super().__init__(path, mapped, descriptor)
        self.position = max(0, int(self._words[_WORD_RESERVED]) - self.capacity)

    def read(self, at_most: int | None = None) -> NDArray[Any]:
        """The rows written since the last call, copied; possibly none.

        Raises RingOverrun when rows were overwritten before they could be read; the next call goes on
        behind them.
        """
        head = int(self._words[_WORD_HEAD])
        _fence()
        # What lies a whole ring behind is gone for certain; do not copy it.
        start = max(self.position, head - self.capacity)
        count = head - start if at_most is None else min(head - start, at_most)
        slot = start % self.capacity
        until_wrap = min(count, self.capacity - slot)
        rows = np.empty(count, self._bytes)
        rows[:until_wrap] = self._rows[slot : slot + until_wrap]
        rows[until_wrap:] = self._rows[: count - until_wrap]
        _fence()
        oldest_whole = int(self._words[_WORD_RESERVED]) - self.capacity
        if oldest_whole > self.position:
            lost, first = oldest_whole - self.position, self.position
            self.position = oldest_whole
            raise RingOverrun(lost, first)
        self.position = start + count
        return rows.view(self.dtype)

    def latest(self, count: int) -> NDArray[Any]:
        """The newest rows, at most `count`, copied; for a live view. Does not move the reader."""
        while True:
            head = int(self._words[_WORD_HEAD])
            _fence()
            start = max(0, head - min(count, self.capacity))
            rows = self._rows[np.arange(start, head) % self.capacity]
            _fence()
            torn = int(self._words[_WORD_RESERVED]) - self.capacity - start
            if torn < max(1, len(rows)):
                return rows[max(0, torn) :].view(self.dtype)

    def publish_position(self) -> None:
        """Tell the writer how far this reader has come; for the recorder alone (`RingWriter.room`)."""
        self._words[_WORD_CONSUMED] = self.position

    @property
    def finished(self) -> bool:
        """Whether the writer said that no row will follow. Read once more after seeing it."""
        closed = bool(self._words[_WORD_CLOSED])
        _fence()
        return closed

    @property
    def writer_alive(self) -> bool:
        """Whether the process that writes still exists."""
        return _process_exists(int(self._words[_WORD_WRITER]))

    def unlink(self) -> None:
        """Remove the name after the writer died."""
        self.path.unlink(missing_ok=True)


def remove_abandoned_rings() -> None:
    """Remove segments that no process has mapped any more: their processes were killed."""
    for path in _FOLDER.glob(f"{_PREFIX}*"):
        try:
            descriptor = os.open(path, os.O_RDWR)
        except OSError:
            continue
        try:
            fcntl.flock(descriptor, fcntl.LOCK_EX | fcntl.LOCK_NB)
            # A ring in the making is locked only a moment after it was created.
            if time.time() - os.fstat(descriptor).st_mtime > 10.0:
                path.unlink(missing_ok=True)
        except OSError:
            pass  # in use
        finally:
            os.close(descriptor)


def _process_exists(process: int) -> bool:
    try:
        os.kill(process, 0)
    except ProcessLookupError:
        return False
    except PermissionError:
        return True
    try:
        # A killed child that was not waited for still has its number.
        stat = Path(f"/proc/{process}/stat").read_text()
    except OSError:
        return True
    return stat.rpartition(")")[2].split()[0] != "Z"


def _description_of_dtype(dtype: np.dtype[Any]) -> list[list[Any]]:
    fields = dtype.fields
    if fields is None:
        raise ValueError("a ring holds structured rows")
    description: list[list[Any]] = []
    for name, (field, offset, *_) in fields.items():
        description.append([name, field.base.str, list(field.shape), offset])
    return [*description, ["", "", [], dtype.itemsize]]


def _dtype_from_description(description: list[list[Any]]) -> np.dtype[Any]:
    *fields, (_, _, _, itemsize) = description
    return np.dtype(
        {
            "names": [name for name, *_ in fields],
            "formats": [(base, tuple(shape)) for _, base, shape, _ in fields],
            "offsets": [offset for *_, offset in fields],
            "itemsize": itemsize,
        }
    )
