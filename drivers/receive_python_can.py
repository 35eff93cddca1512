"""Frames from any python-can interface, as blocks.

For slcan, vendors' adapters and the virtual bus. The stamps are what python-can gives: the adapter's or the
system's clock at reception. Frames lost inside an adapter cannot be seen from here; `dropped` stays zero and
the alignment on SYNC marks the gaps.
"""

import struct
import time

import can
import numpy as np

from drivers import frames
from drivers.bus import BusSettings, Filters, open_bus, reason_in_words
from drivers.errors import BusError
from drivers.frames import FD_FRAME, FRAME, FrameBlock
from drivers.virtual_bus import InProcessBus

_CLASSIC_ROW = struct.Struct("<qIBBxx8s")
_FD_ROW = struct.Struct("<qIBBxx64s")


class PythonCanReceiver:
    """A `FrameReceiver` over python-can.

    settings : the bus
    filters  : python-can's filters (see `drivers.bus.pass_ids`); None receives everything
    """

    def __init__(self, settings: BusSettings, filters: Filters | None = None):
        self.settings = settings
        self.filters = filters
        self.dtype = FD_FRAME if settings.fd else FRAME
        self._row = _FD_ROW if settings.fd else _CLASSIC_ROW
        self._bus: can.BusABC | None = None
        self._hears_itself = False
        self._sent: list[bytes] = []

    dropped = 0

    @property
    def clock_source(self) -> str:
        """Which clock stamped the frames."""
        if self.settings.interface == "virtual":
            return "clock of the virtual bus"
        return f"python-can {can.__version__}, interface {self.settings.interface}"

    @property
    def bus(self) -> can.BusABC:
        """The open bus.

        Raises BusError before `open` and after `close`.
        """
        if self._bus is None:
            raise BusError(f"bus {self.settings} is not open")
        return self._bus

    def open(self) -> None:
        """Start receiving; BusError when that is not possible."""
        if self._bus is None:
            # Only the virtual bus and SocketCAN reflect a frame at its place on the bus; elsewhere `send`
            # notes it.
            self._hears_itself = self.settings.interface in ("virtual", "socketcan")
            self._bus = open_bus(self.settings, filters=self.filters, receive_own_messages=self._hears_itself)

    def read(self) -> FrameBlock:
        """(N,) frames since the last call."""
        bus = self.bus
        pack = self._row.pack
        if isinstance(bus, InProcessBus):
            rows = [pack(stamp, can_id, flags, len(data), data) for stamp, can_id, data, flags in bus.take()]
        else:
            rows, self._sent = self._sent, []
            try:
                while (message := bus.recv(0)) is not None:
                    rows.append(self._packed(message))
            except (can.CanError, OSError) as error:
                raise BusError(f"bus {self.settings}: {reason_in_words(error)}") from error
        return np.frombuffer(b"".join(rows), self.dtype)

    def send(self, can_id: int, data: bytes) -> None:
        """Send one data frame with an 11-bit id; BusError when it cannot be sent."""
        bus = self.bus
        if isinstance(bus, InProcessBus):
            bus.send_frame(can_id, data)
            return
        try:
            bus.send(can.Message(arbitration_id=can_id, is_extended_id=False, data=data))
        except (can.CanError, OSError) as error:
            raise BusError(
                f"bus {self.settings}: frame 0x{can_id:03X} not sent: {reason_in_words(error)}"
            ) from error
        if not self._hears_itself:
            # What has come until now was on the bus before this frame.
            self._sent.extend(iter(self._received_until_now, None))
            self._sent.append(self._row.pack(time.time_ns(), can_id, frames.OWN, len(data), data))

    def close(self) -> None:
        """Stop receiving."""
        if self._bus is not None:
            self._bus.shutdown()
            self._bus = None

    def _received_until_now(self) -> bytes | None:
        message = self.bus.recv(0)
        return None if message is None else self._packed(message)

    def _packed(self, message: can.Message) -> bytes:
        flags = (
            frames.EXTENDED * message.is_extended_id
            | frames.REMOTE * message.is_remote_frame
            | frames.ERROR * message.is_error_frame
            | frames.FD * message.is_fd
            | frames.BITRATE_SWITCH * message.bitrate_switch
            | frames.ERROR_STATE * message.error_state_indicator
            | frames.OWN * (not message.is_rx)
        )
        stamp = round(message.timestamp * 1e9)
        return self._row.pack(stamp, message.arbitration_id, flags, message.dlc, bytes(message.data))
