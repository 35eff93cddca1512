"""Positions of one cycle for a loop over the bus: read in SYNC's thread, before the setpoints of the same cycle go out."""

import time
from collections.abc import Sequence
from typing import Any

import numpy as np

from drivers.frames import FrameReceiver
from drivers.process_data import DriveStream
from drivers.sync_producer import SYNC_ID

AFTER_SILENCE = 0.01
"""s, at most, that positions are waited for while those of the cycle before did not come either: behind simulated drives, for
which time waits, one that is silent would hold up everything, a stop too"""


class PositionInput:
    """The newest positions since the last SYNC on the bus.

    receiver : of SYNC and of the TPDOs that carry positions; nobody else reads it
    patience : s after SYNC for all positions to come
    """

    def __init__(self, receiver: FrameReceiver, streams: Sequence[DriveStream], patience: float) -> None:
        self._receiver = receiver
        self._patience = patience
        self._places: dict[int, tuple[int, int, np.dtype[Any]]] = {}
        for axis, stream in enumerate(streams):
            pdo, entry = stream.find("position")
            self._places[pdo.can_id] = (axis, entry.byte_offset, np.dtype(entry.kind))
        self._held: list[int | None] = [None] * len(streams)
        self._synchronised = False
        self._came = True

    def take(self) -> list[int] | None:
        """(n) counts of this cycle; None where one did not come in time. Raises BusError when the bus fails."""
        latest = time.monotonic() + (self._patience if self._came else min(self._patience, AFTER_SILENCE))
        self._came = False
        self._read()
        while not self._synchronised or any(each is None for each in self._held):
            left = latest - time.monotonic()
            if left <= 0.0:
                return None
            self._receiver.wait(left)
            self._read()
        counts = [each for each in self._held if each is not None]
        self._held = [None] * len(self._held)
        self._synchronised = False
        self._came = True
        return counts

    def _read(self) -> None:
        frames = self._receiver.read()
        identifiers = frames["can_id"].tolist()
        for row, identifier in enumerate(identifiers):
            if identifier == SYNC_ID:
                # what came before it is of another cycle
                self._held = [None] * len(self._held)
                self._synchronised = True
                continue
            place = self._places.get(identifier)
            if place is not None:
                axis, offset, kind = place
                data = frames["data"][row, offset : offset + kind.itemsize]
                self._held[axis] = int(np.ascontiguousarray(data).view(kind)[0])

    def close(self) -> None:
        """Stop receiving."""
        self._receiver.close()
