"""Frames from SocketCAN as blocks: our own raw socket, read with recvmmsg, stamped by the kernel.

Measured on a full 1 Mbit/s bus (9009 frames/s), waking up costs more than frames do: python-can with
callbacks takes half of a core, a sleep of 1 ms followed by one `recvmmsg` of everything that waits takes a
tenth (`benchmarks/receive_path.py`). Hence no thread here and no callback: the caller sleeps, then calls
`read`.

What the kernel offers and python-can leaves: SO_RCVBUFFORCE (the default buffer holds 278 frames, 31 ms of a
full bus, and then loses silently), SO_RXQ_OVFL (how many were lost), SO_TIMESTAMPNS (when a frame arrived).
"""

import ctypes
import errno
import os
import select
import socket
import struct

import numpy as np
from numpy.typing import NDArray

from drivers import frames
from drivers.bus import Filters, check_network_interface
from drivers.errors import BusError, reason_in_words
from drivers.frames import FD_FRAME, FRAME, FrameBlock

BLOCK = 512  # frames per recvmmsg; 57 ms of a full bus
RECEIVE_BUFFER = 8 * 1024 * 1024  # bytes; a frame takes about 770 of them, so 1.2 s of a full bus

# Linux numbers that the socket module does not name (asm-generic/socket.h, 64-bit time; linux/can/raw.h).
_SO_RCVBUFFORCE = 33
_SO_TIMESTAMPNS = 35
_SO_RXQ_OVFL = 40
_CAN_RAW_ERR_FILTER = 2
_MSG_DONTWAIT = 0x40
_MSG_CONFIRM = 0x800  # set on frames that this socket sent
_CANFD_BRS, _CANFD_ESI = 0x01, 0x02

_CLASSIC_BYTES, _FD_BYTES = 16, 72  # struct can_frame, struct canfd_frame
_CAN_FRAME = struct.Struct("<IB3x8s")
_STAMP_CONTROL = 32  # cmsghdr of 16 bytes and a timespec
_CONTROL_BYTES = 64  # that, and a cmsghdr with the drop count

# struct mmsghdr on 64-bit Linux
_MESSAGE_HEADER = np.dtype(
    {
        "names": ["iov", "iovlen", "control", "controllen", "flags", "length"],
        "formats": ["<u8", "<u8", "<u8", "<u8", "<i4", "<u4"],
        "offsets": [16, 24, 32, 40, 48, 56],
        "itemsize": 64,
    }
)
_VECTOR = np.dtype([("base", "<u8"), ("length", "<u8")])

_STAMP_BYTES = 8  # of a row, before what the kernel writes
_CONFIRM_TO_OWN = 5  # bits from MSG_CONFIRM to OWN

_libc = ctypes.CDLL(None, use_errno=True)


class SocketCanReceiver:
    """A `FrameReceiver` over a raw SocketCAN socket.

    channel        : network interface, e.g. can0
    filters        : python-can's filters (see `drivers.bus.pass_ids`), applied by the kernel; None passes all
    fd             : receive CAN FD frames too; blocks then have dtype FD_FRAME
    receive_buffer : bytes asked of the kernel; without CAP_NET_ADMIN it grants at most net.core.rmem_max
    """

    clock_source = "kernel, CLOCK_REALTIME at reception (SO_TIMESTAMPNS)"

    def __init__(
        self,
        channel: str,
        filters: Filters | None = None,
        *,
        fd: bool = False,
        receive_buffer: int = RECEIVE_BUFFER,
    ):
        self.channel = channel
        self.filters = filters
        self.fd = fd
        self.receive_buffer = receive_buffer
        self.dtype = FD_FRAME if fd else FRAME
        self.dropped = 0
        self._socket: socket.socket | None = None
        self._allocate()

    def _allocate(self) -> None:
        """Buffers for one recvmmsg: the kernel writes each frame into a row, behind the place of its stamp."""
        size = _FD_BYTES if self.fd else _CLASSIC_BYTES
        self._rows = np.zeros(BLOCK, self.dtype)
        control = np.zeros((BLOCK, _CONTROL_BYTES), np.uint8)
        vectors = np.zeros(BLOCK, _VECTOR)
        headers = np.zeros(BLOCK, _MESSAGE_HEADER)
        rows = np.arange(BLOCK, dtype=np.uint64)
        vectors["base"] = self._rows.ctypes.data + _STAMP_BYTES + rows * self.dtype.itemsize
        vectors["length"] = size
        headers["iov"] = vectors.ctypes.data + rows * _VECTOR.itemsize
        headers["iovlen"] = 1
        headers["controllen"] = _CONTROL_BYTES
        headers["control"] = control.ctypes.data + rows * _CONTROL_BYTES
        self._memory = (control, vectors, headers)  # the kernel has their addresses
        self._first_header = ctypes.c_void_p(headers.ctypes.data)
        # Views of what the kernel writes, made once.
        self._can_id = self._rows["can_id"]
        self._flags = self._rows["flags"]
        self._control_length = headers["controllen"]
        self._message_flags = headers["flags"]
        self._received = headers["length"]
        self._seconds = np.ndarray(BLOCK, "<i8", control, 16, (_CONTROL_BYTES,))
        self._nanoseconds = np.ndarray(BLOCK, "<i8", control, 24, (_CONTROL_BYTES,))
        self._drop_count = np.ndarray(BLOCK, "<u4", control, _STAMP_CONTROL + 16, (_CONTROL_BYTES,))

    def open(self) -> None:
        """Open the socket and start receiving.

        Raises BusError when the interface is not there, is down or is not permitted.
        """
        if self._socket is not None:
            return
        if struct.calcsize("P") != 8 or not hasattr(socket, "AF_CAN"):
            raise BusError("SocketCAN is received on 64-bit Linux only")
        check_network_interface(self.channel)
        try:
            raw = socket.socket(socket.AF_CAN, socket.SOCK_RAW, socket.CAN_RAW)
        except OSError as error:
            raise BusError(f"CAN interface {self.channel!r}: {reason_in_words(error)}") from error
        try:
            self._configure(raw)
            raw.bind((self.channel,))
        except OSError as error:
            raw.close()
            raise BusError(f"CAN interface {self.channel!r}: {reason_in_words(error)}") from error
        self._socket = raw

    def _configure(self, raw: socket.socket) -> None:
        raw.setblocking(False)
        if self.filters is not None:
            entries = [
                struct.pack(
                    "=II",
                    entry["can_id"] | (socket.CAN_EFF_FLAG if entry.get("extended") else 0),
                    entry["can_mask"] | socket.CAN_EFF_FLAG,
                )
                for entry in self.filters
            ]
            raw.setsockopt(socket.SOL_CAN_RAW, socket.CAN_RAW_FILTER, b"".join(entries))
        raw.setsockopt(socket.SOL_CAN_RAW, _CAN_RAW_ERR_FILTER, frames.BUS_OFF)
        raw.setsockopt(socket.SOL_CAN_RAW, socket.CAN_RAW_RECV_OWN_MSGS, 1)
        if self.fd:
            raw.setsockopt(socket.SOL_CAN_RAW, socket.CAN_RAW_FD_FRAMES, 1)
        try:
            raw.setsockopt(socket.SOL_SOCKET, _SO_RCVBUFFORCE, self.receive_buffer)
        except PermissionError:
            raw.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, self.receive_buffer)
        raw.setsockopt(socket.SOL_SOCKET, _SO_TIMESTAMPNS, 1)
        raw.setsockopt(socket.SOL_SOCKET, _SO_RXQ_OVFL, 1)

    @property
    def granted_buffer(self) -> int:
        """Bytes of receive buffer that the kernel granted."""
        return self._open_socket().getsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF)

    def fileno(self) -> int:
        """File descriptor, for `select`."""
        return self._open_socket().fileno()

    def _open_socket(self) -> socket.socket:
        if self._socket is None:
            raise BusError(f"CAN interface {self.channel!r} is not open")
        return self._socket

    def read(self) -> FrameBlock:
        """(N,) frames since the last call, never blocking.

        Raises BusError when the interface went down or away.
        """
        descriptor = self._open_socket().fileno()
        blocks: list[FrameBlock] = []
        while True:
            count = self._receive(descriptor)
            if count:
                blocks.append(self._block(count))
            if count < BLOCK:
                break
        if len(blocks) == 1:
            return blocks[0]
        return np.concatenate(blocks) if blocks else np.empty(0, self.dtype)

    def _receive(self, descriptor: int) -> int:
        """One recvmmsg into the rows; the number of frames."""
        count = _libc.recvmmsg(descriptor, self._first_header, BLOCK, _MSG_DONTWAIT, None)
        if count >= 0:
            return count
        number = ctypes.get_errno()
        if number in (errno.EAGAIN, errno.EINTR):
            return 0
        error = OSError(number, os.strerror(number))
        raise BusError(f"CAN interface {self.channel!r}: {reason_in_words(error)}") from error

    def _block(self, count: int) -> FrameBlock:
        """The first `count` rows as frames: stamped, flagged, ids without the kernel's flag bits."""
        rows = self._rows[:count]
        rows["stamp"] = self._seconds[:count] * 1_000_000_000 + self._nanoseconds[:count]
        kernel_flags = self._flags[:count].copy() if self.fd else None
        self._flags[:count] = (self._message_flags[:count] & _MSG_CONFIRM) >> _CONFIRM_TO_OWN
        rows["reserved"] = 0
        if self._can_id[:count].max() > socket.CAN_SFF_MASK:
            self._unusual_ids(count)
        if kernel_flags is not None:
            self._fd_flags(count, kernel_flags)
        if self._control_length[:count].max() > _STAMP_CONTROL:  # only once something was lost
            counted = self._control_length[:count] > _STAMP_CONTROL
            self.dropped = int(self._drop_count[:count][counted][-1])
        self._control_length[:count] = _CONTROL_BYTES  # what the kernel overwrote, and only that
        return rows.copy()

    def _unusual_ids(self, count: int) -> None:
        """Extended, remote and error frames: the kernel's bits become flags."""
        kernel_id = self._can_id[:count]
        extended = (kernel_id & socket.CAN_EFF_FLAG) != 0
        error = (kernel_id & socket.CAN_ERR_FLAG) != 0
        self._flags[:count] |= (
            frames.EXTENDED * extended
            + frames.REMOTE * ((kernel_id & socket.CAN_RTR_FLAG) != 0)
            + frames.ERROR * error
        ).astype(np.uint8)
        kernel_id &= np.where(extended | error, socket.CAN_EFF_MASK, socket.CAN_SFF_MASK).astype(np.uint32)

    def _fd_flags(self, count: int, kernel_flags: NDArray[np.uint8]) -> None:
        """CAN FD frames among classic ones; those leave what the row held before behind their data."""
        is_fd = self._received[:count] == _FD_BYTES
        self._flags[:count] |= (
            frames.FD * is_fd
            + frames.BITRATE_SWITCH * (is_fd & ((kernel_flags & _CANFD_BRS) != 0))
            + frames.ERROR_STATE * (is_fd & ((kernel_flags & _CANFD_ESI) != 0))
        ).astype(np.uint8)
        self._rows["data"][:count][~is_fd, 8:] = 0

    def wait(self, timeout: float) -> None:
        """Return when frames have come, after `timeout` s at the latest."""
        select.select([self._open_socket()], [], [], timeout)

    def send(self, can_id: int, data: bytes) -> None:
        """Send one classic data frame with an 11-bit id.

        Raises BusError when the interface refuses it, for example because nobody acknowledges on the bus.
        """
        try:
            self._open_socket().send(_CAN_FRAME.pack(can_id, len(data), data))
        except OSError as error:
            if error.errno in (errno.ENOBUFS, errno.EAGAIN):
                raise BusError(
                    f"CAN interface {self.channel!r}: the transmit queue is full; is anyone else on the bus, "
                    f"and does the bit rate fit?"
                ) from error
            raise BusError(f"CAN interface {self.channel!r}: {reason_in_words(error)}") from error

    def close(self) -> None:
        """Stop receiving."""
        if self._socket is not None:
            self._socket.close()
            self._socket = None
