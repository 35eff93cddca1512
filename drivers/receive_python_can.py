"""Frames from any python-can interface but socketcan, as blocks.

For slcan, vendors' adapters and the virtual bus. The stamps are what python-can gives: the adapter's or the
system's clock at reception. Frames lost inside an adapter cannot be seen from here; `dropped` stays zero
and the alignment on SYNC marks the gaps.
"""

import struct
import time

import can
import numpy as np

from drivers.bus import BusSettings, Filters, open_bus
from drivers.errors import BusError, reason_in_words
from drivers.frames import FD_FRAME, FRAME, FrameBlock
from drivers.virtual_bus import InProcessBus

_CLASSIC_ROW = struct.Struct("<qIBBxx8s")
_FD_ROW = struct.Struct("<qIBBxx64s")
_NAP = 0.0001
"""s between two looks for frames"""


class PythonCanReceiver:
    """A `FrameReceiver` over python-can.

    settings : the bus
    filters  : python-can's filters (see `drivers.bus.pass_ids`); None receives everything
    """

    dropped = 0

    def __init__(self, settings: BusSettings, filters: Filters | None = None):
        self.settings = settings
        self.filters = filters
        self.dtype = FD_FRAME if settings.fd else FRAME
        self._row = _FD_ROW if settings.fd else _CLASSIC_ROW
        self._bus: InProcessBus | None = None

    @property
    def clock_source(self) -> str:
        """Which clock stamped the frames."""
        if self.settings.interface == "virtual":
            return "clock of the virtual bus"
        return f"python-can {can.__version__}, interface {self.settings.interface}"

    @property
    def bus(self) -> InProcessBus:
        """The open bus.

        Raises BusError before `open` and after `close`.
        """
        if self._bus is None:
            raise BusError(f"bus {self.settings} is not open")
        return self._bus

    def open(self) -> None:
        """Start receiving.

        Raises BusError when that is not possible.
        """
        if self._bus is not None:
            return
        bus = open_bus(self.settings, filters=self.filters, receive_own_messages=True)
        if not isinstance(bus, InProcessBus):
            bus.shutdown()
            raise BusError(f"bus {self.settings} is received by receive_socketcan.py")
        self._bus = bus

    def read(self) -> FrameBlock:
        """(N,) frames since the last call.

        Raises BusError when the adapter has gone.
        """
        pack = self._row.pack
        try:
            waiting = self.bus.take()
        except can.CanError as error:
            raise BusError(f"bus {self.settings}: {reason_in_words(error)}") from error
        rows = [pack(stamp, can_id, len(data), flags, data) for stamp, can_id, data, flags in waiting]
        return np.frombuffer(b"".join(rows), self.dtype)

    def wait(self, timeout: float) -> None:
        """Return after a nap: not every adapter of python-can has something to wait on."""
        time.sleep(min(timeout, _NAP))

    def send(self, can_id: int, data: bytes) -> None:
        """Send one data frame with an 11-bit id.

        Raises BusError when it cannot be sent.
        """
        try:
            self.bus.send_frame(can_id, data)
        except (can.CanError, OSError) as error:
            raise BusError(
                f"bus {self.settings}: frame 0x{can_id:03X} not sent: {reason_in_words(error)}"
            ) from error

    def close(self) -> None:
        """Stop receiving; harmless when repeated."""
        if self._bus is not None:
            self._bus.shutdown()
            self._bus = None
