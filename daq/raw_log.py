"""The raw frames of a session in the log format of can-utils: what was on the bus, whatever we made of it.

One frame a line, `(seconds.microseconds) channel ID#DATA`, as `candump -l` writes it; `canplayer`, `log2asc` and
python-can's `CanutilsLogReader` read it. CAN FD frames stand with `##` and a digit of flags.
"""

import fcntl
import os
from pathlib import Path
from typing import IO, Any

from numpy.typing import NDArray

from drivers.frames import BITRATE_SWITCH, ERROR, ERROR_STATE, EXTENDED, FD, REMOTE

_ERROR_FLAG = 0x20000000
"""CAN_ERR_FLAG of linux/can.h, by which candump marks an error frame's id"""


class RawLog:
    """Appends blocks of frames to a log file.

    path : the file, created; with `claimed`, the empty one that `claim_recording` made
    channel : name that stands in every line; spaces would break the format

    Raises FileExistsError where the file is somebody else's.
    """

    def __init__(self, path: Path, channel: str, claimed: bool = False) -> None:
        self.path = path
        self._channel = "_".join(channel.split()) or "can"
        self._file: IO[str] = path.open("r+" if claimed else "x", encoding="ascii", buffering=1 << 16)
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

    def append(self, frames: NDArray[Any]) -> None:
        """Write frames (N,) of `drivers.frames.FRAME` or `FD_FRAME`, in their order."""
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
        self._file.writelines(lines)
        self.frames += len(frames)

    def flush(self, to_disk: bool = False) -> None:
        """Hand everything to the operating system, with `to_disk` to the disk."""
        self._file.flush()
        if to_disk:
            os.fsync(self._file.fileno())

    def close(self) -> None:
        """Flush to disk and close; harmless when repeated."""
        if not self._file.closed:
            self.flush(to_disk=True)
            self._file.close()


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
