"""WebSockets on which we speak and the other side says hardly anything.

A message is answered by nothing here, but every frame costs its parsing: one viewer who sends frames as fast as a connection
takes them held the event loop for seconds. What is more than a browser or a client library says ends the connection, unread.
"""

import time

from uvicorn.protocols.websockets.websockets_sansio_impl import WebSocketsSansIOProtocol

SAID_AT_ONCE = 1024
"""bytes: pings, pongs, a word of farewell"""
SAID_PER_SECOND = 128.0
"""bytes that are listened to for longer"""


class QuietWebSocket(WebSocketsSansIOProtocol):
    """uvicorn's WebSocket, for a connection that is closed if the other side says more."""

    _allowance = float(SAID_AT_ONCE)
    _counted_at: float | None = None

    def data_received(self, data: bytes) -> None:
        """Count what comes after the handshake, before it is parsed."""
        now = time.monotonic()
        if self._counted_at is not None:
            regained = (now - self._counted_at) * SAID_PER_SECOND
            self._allowance = min(SAID_AT_ONCE, self._allowance + regained) - len(data)
            if self._allowance < 0:
                self.transport.abort()
                return
        self._counted_at = now
        super().data_received(data)
