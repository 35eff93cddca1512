"""Live samples for any number of viewers: one producer, one encoded block, dropped for the slow ones.

A block is encoded once and the same bytes go to every viewer. A viewer whose connection cannot take more
loses the oldest blocks that wait for it; nobody else notices, the acquisition least of all: it is read from
its ring buffer, which it never waits for.
"""

import asyncio
import struct
from collections import deque
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

BLOCKS_WAITING = 4
"""Blocks kept for a viewer that is behind; more would only make it later."""
BLOCK_HEADER = struct.Struct("<IIdI4x")
"""Rows, columns, time origin in s, number of axes; 24 bytes, so that what follows is aligned."""


def encode_block(origin: float, values: NDArray[np.float32], axes: int) -> bytes:
    """A block as it travels: header, then `values` (columns, rows) float32, little-endian, column by column.

    The first column is the time less `origin`; then, of every axis each, position, command, following error, setpoint,
    predicted command (NaN where nothing is predicted) and temperature (°C, NaN where none is recorded).
    """
    columns, rows = values.shape
    return BLOCK_HEADER.pack(rows, columns, origin, axes) + np.ascontiguousarray(values, "<f4").tobytes()


def decode_block(block: bytes) -> tuple[float, NDArray[np.float32], int]:
    """The opposite of `encode_block`."""
    rows, columns, origin, axes = BLOCK_HEADER.unpack_from(block)
    values = np.frombuffer(block, "<f4", offset=BLOCK_HEADER.size).reshape(columns, rows)
    return origin, values, axes


@dataclass(eq=False)
class Viewer:
    """One connection's share of the fan-out; used within the event loop only.

    dropped : blocks that this viewer was too slow for
    """

    blocks: deque[bytes] = field(default_factory=lambda: deque(maxlen=BLOCKS_WAITING))
    status: str | None = None
    dropped: int = 0
    _news: asyncio.Event = field(default_factory=asyncio.Event)

    def offer(self, block: bytes) -> None:
        """Put a block in line; the oldest falls out if the line is full."""
        if len(self.blocks) == self.blocks.maxlen:
            self.dropped += 1
        self.blocks.append(block)
        self._news.set()

    def tell(self, status: str) -> None:
        """Replace the status to be sent next: only the newest counts."""
        self.status = status
        self._news.set()

    async def next(self) -> bytes | str:
        """The next message for this viewer: a status (text) before blocks (bytes)."""
        while True:
            if self.status is not None:
                status, self.status = self.status, None
                return status
            if self.blocks:
                return self.blocks.popleft()
            self._news.clear()
            await self._news.wait()


class Broadcast:
    """The viewers of one rig."""

    def __init__(self) -> None:
        self.viewers: set[Viewer] = set()
        self._last_status: str | None = None

    def join(self) -> Viewer:
        """A new viewer; it is told the present status at once."""
        viewer = Viewer()
        if self._last_status is not None:
            viewer.tell(self._last_status)
        self.viewers.add(viewer)
        return viewer

    def leave(self, viewer: Viewer) -> None:
        """Forget a viewer."""
        self.viewers.discard(viewer)

    def send_block(self, block: bytes) -> None:
        """Offer one encoded block to every viewer."""
        for viewer in self.viewers:
            viewer.offer(block)

    def send_status(self, status: str) -> None:
        """Tell every viewer, and whoever comes later, the newest status (JSON)."""
        self._last_status = status
        for viewer in self.viewers:
            viewer.tell(status)
