"""The raw frames of a session in the log format of can-utils: what was on the bus, whatever we made of it.

One frame a line, `(seconds.microseconds) channel ID#DATA`, as `candump -l` writes it; CAN FD frames stand with `##` and a
digit of flags. The file is compressed by gzip, a member (RFC 1952, section 2.2) for each block that is written, so that
what is on the disk can be read whenever the recorder dies; `zcat FILE | canplayer`, `log2asc` and python-can's `LogReader`
read it. Earlier versions wrote it uncompressed (`.log`), and such files are read everywhere as well.
"""

import fcntl
import gzip
import os
import zlib
from collections.abc import Iterator
from pathlib import Path
from typing import IO, Any

from numpy.typing import NDArray

from drivers.frames import BITRATE_SWITCH, ERROR, ERROR_STATE, EXTENDED, FD, REMOTE

_ERROR_FLAG = 0x20000000
"""CAN_ERR_FLAG of linux/can.h, by which candump marks an error frame's id"""
_BLOCK = 1 << 20
"""bytes of text after which a block is written before it is time to flush"""
_CHUNK = 1 << 20
_GZIP = 16 + zlib.MAX_WBITS
"""zlib's word for the format of gzip"""
_QUICKEST = 1
"""gzip's level: five times smaller at 0.2 % of a core on a full bus"""
COMPRESSED = ".gz"


def raw_log_of(recording: Path) -> Path:
    """Where the raw frames of a recording stand, or will stand: compressed, or as an earlier version left them."""
    plain = recording.with_suffix(".log")
    compressed = plain.with_name(plain.name + COMPRESSED)
    return plain if plain.exists() and not compressed.exists() else compressed


def text_of(log: Path) -> Iterator[bytes]:
    """The lines of a raw log in blocks, compressed or not; a block that was cut short at the end is left out.

    Raises OSError when the file cannot be read.
    """
    if log.suffix == COMPRESSED:
        for text, _end in _members(log):
            yield text
        return
    with log.open("rb") as file:
        while chunk := file.read(_CHUNK):
            yield chunk


def mend(log: Path) -> None:
    """Cut what was written in part at the end; a reader would stumble over it."""
    if log.suffix == COMPRESSED:
        whole = max((end for _text, end in _members(log)), default=0)
    else:
        with log.open("rb") as file:
            end = file.seek(0, os.SEEK_END)
            start = max(0, end - 4096)
            file.seek(start)
            whole = start + file.read().rfind(b"\n") + 1
    if whole < log.stat().st_size:
        os.truncate(log, whole)


def _members(log: Path) -> Iterator[tuple[bytes, int]]:
    """The text of every whole member, and where in the file it ends."""
    with log.open("rb") as file:
        member, text = zlib.decompressobj(_GZIP), bytearray()
        while chunk := file.read(_CHUNK):
            while chunk:
                try:
                    text += member.decompress(chunk)
                except zlib.error:
                    return  # nothing after it can be told from it
                if not member.eof:
                    break
                chunk = member.unused_data
                yield bytes(text), file.tell() - len(chunk)
                member, text = zlib.decompressobj(_GZIP), bytearray()


class RawLog:
    """Appends blocks of frames to a log file.

    path : the file, created; with `claimed`, the empty one that `claim_recording` made; compressed where it ends in `.gz`
    channel : name that stands in every line; spaces would break the format

    Raises FileExistsError where the file is somebody else's.
    """

    def __init__(self, path: Path, channel: str, claimed: bool = False) -> None:
        self.path = path
        self._channel = "_".join(channel.split()) or "can"
        self._compressed = path.suffix == COMPRESSED
        self._file: IO[bytes] = path.open("r+b" if claimed else "xb", buffering=0)
        # Says to `coulomb recover` that somebody is at work; it goes with the process, however that ends.
        try:
            fcntl.flock(self._file, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except BlockingIOError:
            self._file.close()
            raise FileExistsError(f"{path} is being written by another recorder") from None
        if os.fstat(self._file.fileno()).st_size:
            self._file.close()
            raise FileExistsError(f"{path} holds the frames of another session")
        self.frames = 0
        self._waiting = bytearray()
        self._end = 0

    def append(self, frames: NDArray[Any]) -> None:
        """Write frames (N,) of `drivers.frames.FRAME` or `FD_FRAME`, in their order.

        Raises OSError where the disk does not take them; they are kept then, and written once it does.
        """
        if not len(frames):
            return
        channel = self._channel
        data = frames["data"].tobytes().hex().upper()
        digits = 2 * frames["data"].shape[1]
        lines: list[str] = []
        columns = (frames[name].tolist() for name in ("stamp", "can_id", "flags", "length"))
        for index, (stamp, identifier, flags, length) in enumerate(zip(*columns, strict=True)):
            start = index * digits
            payload = data[start : start + 2 * length]
            seconds, nanoseconds = divmod(stamp, 1_000_000_000)
            time = f"({seconds}.{nanoseconds // 1000:06d}) {channel}"
            if not flags & (EXTENDED | REMOTE | ERROR | FD):
                lines.append(f"{time} {identifier:03X}#{payload}\n")
            else:
                lines.append(f"{time} {_unusual(identifier, flags, payload)}\n")
        self._waiting += "".join(lines).encode("ascii")
        self.frames += len(frames)
        if len(self._waiting) >= _BLOCK:
            self._write()

    def flush(self, to_disk: bool = False) -> None:
        """Hand everything to the operating system, with `to_disk` to the disk. Raises OSError where it does not take it."""
        self._write()
        if to_disk:
            os.fsync(self._file.fileno())

    def close(self) -> None:
        """Flush to disk and close; harmless when repeated."""
        if not self._file.closed:
            self.flush(to_disk=True)
            self._file.close()

    def _write(self) -> None:
        """What waits as one block; none of it stays in the file where the disk does not take all."""
        if not self._waiting:
            return
        block = memoryview(gzip.compress(self._waiting, _QUICKEST) if self._compressed else self._waiting)
        try:
            done = 0
            while done < len(block):
                done += self._file.write(block[done:])
        except OSError:
            self._file.truncate(self._end)
            self._file.seek(self._end)
            raise
        self._end += len(block)
        self._waiting = bytearray()


def _unusual(identifier: int, flags: int, payload: str) -> str:
    """Id and data of an extended, remote, error or FD frame."""
    if flags & ERROR:
        return f"{identifier | _ERROR_FLAG:08X}#{payload}"
    name = f"{identifier:08X}" if flags & EXTENDED else f"{identifier:03X}"
    if flags & REMOTE:
        return f"{name}#R"
    if flags & FD:
        digit = (1 if flags & BITRATE_SWITCH else 0) | (2 if flags & ERROR_STATE else 0)
        return f"{name}##{digit}{payload}"
    return f"{name}#{payload}"
