"""One adapter, many listeners: brings a CAN adapter that can be opened only once onto a virtual channel.

A serial adapter (slcan) and most vendors' interfaces belong to the one who opened them, but receiver, SYNC
and canopen each want a bus of their own with filters of their own. A gateway opens the adapter, and a
thread of it passes what it receives to a channel of the in-process bus, with the adapter's stamp. Frames
sent on that channel go out by the adapter. The first who needs the adapter opens it, the last who leaves
closes it.
"""

import contextlib
import threading
from collections import deque
from collections.abc import Callable
from typing import Any

import can

from drivers.errors import reason_in_words
from drivers.virtual_bus import InProcessBus, frame_of, remote_frame

_RECEIVE_CYCLE = 0.05  # s; closing waits for one of them

_ECHOING = frozenset({"udp_multicast"})
"""Interfaces of python-can that give back what was sent by them, unmarked, whatever `receive_own_messages` says."""


class _Echoes:
    """Tells the echo of our own frames from equal frames of others: echoes come back in the order of sending."""

    def __init__(self) -> None:
        self._out: deque[tuple[int, bytes]] = deque(maxlen=4096)
        self._lock = threading.Lock()

    def sent(self, can_id: int, data: bytes) -> None:
        """To be called before the frame goes out, in the order of sending."""
        with self._lock:
            self._out.append((can_id, data))

    def is_echo(self, can_id: int, data: bytes) -> bool:
        """Whether a received frame is one of ours; the echoes of frames sent before it were lost then."""
        with self._lock:
            try:
                place = self._out.index((can_id, data))
            except ValueError:
                return False
            for _lost in range(place + 1):
                self._out.popleft()
        return True


_gateways: dict[str, "_Gateway"] = {}
_gateways_lock = threading.Lock()


class _Gateway:
    """The adapter and the thread that listens to it."""

    def __init__(self, key: str, interface: str, channel: str, adapter: can.BusABC):
        self.key = key
        self.channel = f"{interface}:{channel}"
        self.members = 0
        self._adapter = adapter
        self._sending = threading.Lock()
        self._echoes = _Echoes() if interface in _ECHOING else None
        self._closing = threading.Event()
        self._port = InProcessBus(key)
        self._port.serve(self._send, self._send_remote)
        self._thread = threading.Thread(target=self._receive, name=f"gateway {self.channel}", daemon=True)
        self._thread.start()

    def _send(self, can_id: int, data: bytes) -> None:
        message = can.Message(arbitration_id=can_id, is_extended_id=can_id > 0x7FF, data=data)
        message.is_fd = len(data) > 8
        with self._sending:
            if self._echoes is not None:
                self._echoes.sent(can_id, data)
            self._adapter.send(message)

    def _send_remote(self, can_id: int) -> None:
        with self._sending:
            if self._echoes is not None:
                self._echoes.sent(can_id, b"")
            self._adapter.send(remote_frame(can_id))

    def _receive(self) -> None:
        while not self._closing.is_set():
            try:
                message = self._adapter.recv(_RECEIVE_CYCLE)
            except (can.CanError, OSError) as error:
                if not self._closing.is_set():
                    self._port.fail(f"{self.channel}: the adapter is gone: {reason_in_words(error)}")
                return
            if message is None:
                continue
            echoes = self._echoes
            if echoes is None or not echoes.is_echo(message.arbitration_id, bytes(message.data)):
                self._port.pass_on(frame_of(message, round(message.timestamp * 1e9)))

    def close(self) -> None:
        self._closing.set()
        self._thread.join(2.0)
        self._port.shutdown()
        with contextlib.suppress(can.CanError, OSError):  # what has gone cannot be closed properly
            self._adapter.shutdown()


class GatewayMember(InProcessBus):
    """A bus on the channel of a gateway; leaving it is `shutdown`, as for any bus."""

    def __init__(self, gateway: _Gateway, can_filters: Any, receive_own_messages: bool):
        super().__init__(gateway.key, can_filters, receive_own_messages)
        self._gateway: _Gateway | None = gateway

    def shutdown(self) -> None:
        """Leave the channel; the adapter is closed with the last member. Harmless when repeated."""
        super().shutdown()
        gateway, self._gateway = self._gateway, None
        if gateway is None:
            return
        with _gateways_lock:
            gateway.members -= 1
            if gateway.members:
                return
            del _gateways[gateway.key]
        gateway.close()


def join(
    key: str,
    interface: str,
    channel: str,
    open_adapter: Callable[[], can.BusABC],
    can_filters: Any = None,
    receive_own_messages: bool = False,
) -> GatewayMember:
    """A bus by the gateway of an adapter; `open_adapter` is called if nobody has opened it yet.

    key : all by which one adapter differs from another: two networks may share a channel's name and differ in their port

    Raises what `open_adapter` raises.
    """
    with _gateways_lock:
        gateway = _gateways.get(key)
        if gateway is None:
            gateway = _gateways[key] = _Gateway(key, interface, channel, open_adapter())
        gateway.members += 1
    return GatewayMember(gateway, can_filters, receive_own_messages)
