"""CAN frames as blocks: structured NumPy arrays of fixed rows, in the order in which they were on the bus.

A `FrameBlock` is an array of dtype `FRAME` (classic CAN, 24 bytes a row) or `FD_FRAME` (CAN FD, 80 bytes a
row):

    stamp    int64   ns; the clock is named by the receiver's `clock_source`
    can_id   uint32  11 or 29 bits, without the kernel's flag bits
    length   uint8   bytes of data that count
    flags    uint8   EXTENDED, REMOTE, ERROR, FD, BITRATE_SWITCH, ERROR_STATE, OWN
    reserved uint16  0
    data     uint8   (8,) or (64,); bytes from `length` on are zero
"""

from collections.abc import Iterable
from typing import Any, Protocol

import numpy as np
from numpy.typing import DTypeLike, NDArray

EXTENDED = 0x01
REMOTE = 0x02
ERROR = 0x04
FD = 0x08
BITRATE_SWITCH = 0x10
ERROR_STATE = 0x20
OWN = 0x40  # sent by the receiver itself

BUS_OFF = 0x40
"""bit in the id of an ERROR frame: the controller has taken itself off the bus (linux/can/error.h, CAN_ERR_BUSOFF)"""

_DATA_OFFSET = 16


def _frame_dtype(data_bytes: int) -> np.dtype:
    # From can_id on the layout is the kernel's (struct can_frame, struct canfd_frame), so that frames are
    # received into rows. Without gaps: np.concatenate would pack them away, and a row would no longer be
    # what `column` expects.
    return np.dtype(
        [
            ("stamp", "<i8"),
            ("can_id", "<u4"),
            ("length", "u1"),
            ("flags", "u1"),
            ("reserved", "<u2"),
            ("data", "u1", (data_bytes,)),
        ]
    )


FRAME = _frame_dtype(8)
FD_FRAME = _frame_dtype(64)

FrameBlock = NDArray[np.void]


class FrameReceiver(Protocol):
    """Where frames come from. `receive_socketcan.py` and `receive_python_can.py` are the two that exist.

    `read` never blocks: it hands over what has come since the last call (possibly nothing). Frames sent
    through `send` appear among them, flagged OWN, at their place on the bus and with their stamp, so that
    the SYNC that we send ourselves cuts the stream where the drives saw it.
    """

    @property
    def dropped(self) -> int:
        """Frames lost since `open` because nobody read in time, as far as the system tells."""
        ...

    @property
    def clock_source(self) -> str:
        """Which clock stamped the frames, in words; stored with every recording."""
        ...

    def open(self) -> None:
        """Start receiving.

        Raises BusError when the interface is not there, down or not permitted.
        """
        ...

    def read(self) -> FrameBlock:
        """(N,) frames since the last call, oldest first.

        Raises BusError when the interface went down.
        """
        ...

    def wait(self, timeout: float) -> None:
        """Return when there may be frames to read, after `timeout` s at the latest."""
        ...

    def send(self, can_id: int, data: bytes) -> None:
        """Send one data frame with an 11-bit id.

        Raises BusError when it cannot be sent.
        """
        ...

    def close(self) -> None:
        """Stop receiving; harmless when repeated."""
        ...


def empty_block(dtype: np.dtype = FRAME) -> FrameBlock:
    """A block without frames."""
    return np.empty(0, dtype)


def column(frames: FrameBlock, byte_offset: int, dtype: DTypeLike) -> NDArray[Any]:
    """The values that lie `byte_offset` bytes into every frame's data, as a view of shape (N,).

    This is how a mapped PDO entry is decoded: one strided view for a whole block, no loop. `dtype` is a
    little-endian scalar type such as "<i4" (CANopen is little-endian, CiA 301 section 7.1).
    """
    kind = np.dtype(dtype)
    if byte_offset < 0 or byte_offset + kind.itemsize > frames.dtype.itemsize - _DATA_OFFSET:
        raise ValueError(
            f"{kind.itemsize} bytes at byte {byte_offset} do not fit a frame of "
            f"{frames.dtype.itemsize - _DATA_OFFSET} data bytes"
        )
    frames = np.ascontiguousarray(frames)
    return np.ndarray(
        shape=frames.shape,
        dtype=kind,
        buffer=frames.data if frames.size else b"",
        offset=_DATA_OFFSET + byte_offset if frames.size else 0,
        strides=frames.strides,
    )


def block_of(frames: Iterable[tuple[int, int, bytes, int]], dtype: np.dtype = FRAME) -> FrameBlock:
    """A block from (stamp, can_id, data, flags) tuples; for a few frames, not for the hot path."""
    rows = list(frames)
    block = np.zeros(len(rows), dtype)
    for row, (stamp, can_id, data, flags) in zip(block, rows, strict=True):
        row["stamp"], row["can_id"], row["flags"], row["length"] = stamp, can_id, flags, len(data)
        row["data"][: len(data)] = np.frombuffer(data, np.uint8)
    return block
