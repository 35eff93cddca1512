"""How simulated nodes reach a bus: served inside this process, or over any real interface.

The nodes know one small interface, `Link`; the same nodes run unchanged on the in-process virtual bus,
where the sender's own thread serves them, and over SocketCAN or any python-can interface, where a thread
receives.
"""

import contextlib
import socket
import struct
import threading
from collections.abc import Callable
from typing import Protocol

from drivers.bus import BusSettings, check_network_interface, open_bus
from drivers.errors import BusError, reason_in_words
from drivers.virtual_bus import InProcessBus

Handler = Callable[[int, bytes], None]
RemoteHandler = Callable[[int], None]
_CAN_FRAME = struct.Struct("<IB3x8s")
_RECEIVE_TIMEOUT = struct.pack("@ll", 0, 100_000)  # struct timeval, 0.1 s; closing waits for one of them


class Link(Protocol):
    """One connection to a bus."""

    def start(self, handler: Handler, remote_handler: RemoteHandler) -> None:
        """Call `handler(can_id, data)` for every data frame from others, `remote_handler(can_id)` for every remote frame,
        one at a time."""
        ...

    def send(self, can_id: int, data: bytes) -> None:
        """Send a frame."""
        ...

    def close(self) -> None:
        """Leave the bus."""
        ...


def open_link(settings: BusSettings) -> Link:
    """The best link that a bus allows.

    Raises BusError when the bus cannot be opened.
    """
    if settings.interface == "socketcan":
        return SocketCanLink(settings.channel)
    bus = open_bus(settings)
    assert isinstance(bus, InProcessBus)  # open_bus: every interface but socketcan
    return InProcessLink(bus)


class InProcessLink:
    """On the virtual bus of this process: frames are handled by whoever sends them."""

    def __init__(self, bus: InProcessBus):
        self.bus = bus
        self.send = bus.send_frame

    def start(self, handler: Handler, remote_handler: RemoteHandler) -> None:
        """Be served from now on."""
        self.bus.serve(handler, remote_handler)

    def close(self) -> None:
        """Leave the bus."""
        self.bus.shutdown()


class SocketCanLink:
    """Over SocketCAN by a raw socket: no object per frame, an answer in tens of microseconds."""

    def __init__(self, channel: str):
        self._closing = threading.Event()
        self._thread: threading.Thread | None = None
        check_network_interface(channel)
        try:
            self._socket = socket.socket(socket.AF_CAN, socket.SOCK_RAW, socket.CAN_RAW)
            self._socket.bind((channel,))
        except OSError as error:
            raise BusError(f"CAN interface {channel!r}: {reason_in_words(error)}") from error
        # The kernel's own time-out: Python's would cost a second system call for every frame.
        self._socket.setsockopt(socket.SOL_SOCKET, socket.SO_RCVTIMEO, _RECEIVE_TIMEOUT)

    def start(self, handler: Handler, remote_handler: RemoteHandler) -> None:
        """Receive in a thread from now on."""
        self._thread = threading.Thread(
            target=self._receive, args=(handler, remote_handler), name="simulated-nodes", daemon=True
        )
        self._thread.start()

    def send(self, can_id: int, data: bytes) -> None:
        """Send a frame; a full transmit queue loses it, as on a real node."""
        with contextlib.suppress(OSError):
            self._socket.send(_CAN_FRAME.pack(can_id, len(data), data), socket.MSG_DONTWAIT)

    def _receive(self, handler: Handler, remote_handler: RemoteHandler) -> None:
        receive, unpack = self._socket.recv, _CAN_FRAME.unpack
        while not self._closing.is_set():
            try:
                can_id, length, data = unpack(receive(16))
            except BlockingIOError:
                continue
            except OSError:
                return
            if can_id <= 0x7FF:  # neither extended, nor remote, nor an error frame
                handler(can_id, data[:length])
            elif can_id & ~0x7FF == socket.CAN_RTR_FLAG:
                remote_handler(can_id & 0x7FF)

    def close(self) -> None:
        """Leave the bus."""
        self._closing.set()
        if self._thread is not None and self._thread is not threading.current_thread():
            self._thread.join(2.0)
        self._socket.close()
