"""The canopen library's view of the bus: SDO, NMT, EMCY and heartbeat, and never a process-data frame.

canopen gets a bus of its own whose filters leave SYNC and the PDOs out, so that no Python callback runs in
the rhythm of the samples; those go through `drivers/frames.py`.
"""

import contextlib
import logging
import threading
import time
from collections import Counter, deque
from collections.abc import Callable
from types import TracebackType
from typing import Any

import can
import canopen
from canopen.network import MessageListener

from drivers.bus import BusSettings, Filters, open_bus
from drivers.emergency import Emergency, parse_emergency
from drivers.errors import BusError, reason_in_words
from drivers.node_guarding import ToggleBit
from drivers.virtual_bus import remote_frame

# canopen logs what it then raises, or what we ask again for; what matters is said by those who ask.
logging.getLogger("canopen").setLevel(logging.CRITICAL)

_NOTIFIER_CYCLE = 0.05  # s; closing the network waits for one of them
_NMT_STATES = {
    0: "INITIALISING",
    4: "STOPPED",
    5: "OPERATIONAL",
    127: "PRE-OPERATIONAL",
}
EMERGENCIES_KEPT = 100  # per node

FrameCallback = Callable[[int, bytearray, float], None]
"""called with CAN id, data and time stamp in s"""


def service_filters() -> Filters:
    """Filters that pass SDO answers, EMCY, and boot-up and heartbeat of all nodes.

    EMCY is 0x081 to 0x0FF and SYNC is 0x080, so the range is covered without its first id.
    """
    emergency = [(0x080 | 1 << bit, 0x7FF & ~((1 << bit) - 1)) for bit in range(7)]
    return [
        {"can_id": can_id, "can_mask": mask, "extended": False}
        for can_id, mask in [(0x580, 0x780), (0x700, 0x780), *emergency]
    ]


def nmt_state_in_words(state: int) -> str:
    """The NMT state of a heartbeat (CiA 301, section 7.2.8.3.2)."""
    return _NMT_STATES.get(state, f"state {state}, which CiA 301 does not define")


class NodeWatch:
    """What a node says about itself: heartbeat or answers to node guarding, boot-up, EMCY."""

    def __init__(self, node: int):
        self.node = node
        self.nmt_state: int | None = None
        self.last_heard: float | None = None  # s, time.monotonic()
        self.signs_of_life = 0
        self.toggle: ToggleBit | None = None  # of a node that is guarded
        self.boot_ups = 0
        self.emergencies: deque[Emergency] = deque(maxlen=EMERGENCIES_KEPT)
        self.on_emergency: Callable[[Emergency], None] | None = None
        self._changed = threading.Condition()

    def on_heartbeat(self, can_id: int, data: bytearray, timestamp: float) -> None:
        """Take a heartbeat, an answer to node guarding, or a boot-up (0x700 + node)."""
        with self._changed:
            if self.toggle is not None and data and not self.toggle.accepts(data[0]):
                return
            state = data[0] & 0x7F if data else None
            self.signs_of_life += 1
            self.last_heard = time.monotonic()
            self.nmt_state = 127 if state == 0 else state
            if state == 0:
                self.boot_ups += 1
            self._changed.notify_all()

    def on_emcy(self, can_id: int, data: bytearray, timestamp: float) -> None:
        """Take an EMCY frame (0x080 + node)."""
        emergency = parse_emergency(self.node, bytes(data), timestamp)
        with self._changed:
            self.emergencies.append(emergency)
            self._changed.notify_all()
        if self.on_emergency is not None:
            self.on_emergency(emergency)

    def wait_for(self, condition: Callable[[], bool], timeout: float) -> bool:
        """Wait until `condition()` holds, asked anew after every frame; False after `timeout` s."""
        with self._changed:
            return self._changed.wait_for(condition, timeout)

    @property
    def silence(self) -> float | None:
        """s since the last sign of life, None when there was none yet."""
        return None if self.last_heard is None else time.monotonic() - self.last_heard


class _Listener(MessageListener):
    """canopen's listener that also takes the end of a bus, which would be printed as a traceback else."""

    def on_error(self, exc: Exception) -> None:
        """The notifier keeps it for who sends next (`canopen.Network.check`), and tries again, until the network is closed."""
        time.sleep(_NOTIFIER_CYCLE)


class _CountingNetwork(canopen.Network):
    """canopen's network that counts what it sends, so that a frame of another master is told from ours."""

    def __init__(self) -> None:
        super().__init__()
        self.listeners = [_Listener(self)]
        self.sent: Counter[int] = Counter()

    def send_message(self, can_id: int, data: bytes, remote: bool = False) -> None:
        # Counted before it goes: whoever sees it on the bus finds it counted.
        self.sent[can_id] += 1
        super().send_message(can_id, data, remote)

    def send_remote(self, can_id: int) -> None:
        """A remote frame for one byte; canopen's would ask for none."""
        assert self.bus is not None
        with self.send_lock:
            self.bus.send(remote_frame(can_id))
        self.check()


class CanopenNetwork:
    """A connection to the services of the nodes on a bus; a context manager.

    settings : the bus

    Raises BusError when the bus cannot be opened.
    """

    def __init__(self, settings: BusSettings):
        self.settings = settings
        self._network = _CountingNetwork()
        self._network.NOTIFIER_CYCLE = _NOTIFIER_CYCLE
        self._network.bus = open_bus(settings, filters=service_filters())
        self._network.connect()  # pyright: ignore[reportUnknownMemberType]  untyped in canopen

    def __enter__(self) -> "CanopenNetwork":
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self.close()

    def close(self) -> None:
        """Leave the bus; harmless when repeated."""
        if self._network.bus is not None:
            # It ends with what ended the network's thread, for example an interface that went down. By then the bus is
            # closed, and whoever asked something of it has been told.
            with contextlib.suppress(can.CanError, OSError):
                self._network.disconnect()

    def add_node(self, node: int) -> canopen.RemoteNode:
        """A node of the network as canopen sees it, without object dictionary and without canopen's EMCY consumer.

        canopen would make its own PDOs from a dictionary, which fails where an EDS has one half of them, and cut answers to the
        EDS's types; objects are read and written by the types of profiles and standards (`drivers.sdo`).
        canopen's consumer fails on short EMCY frames and then hides them from everybody; `watch` has ours.
        """
        known = self._network.nodes.pop(node, None)
        if isinstance(known, canopen.RemoteNode):
            self._network.subscribe(0x80 + node, _emcy_consumer(known))  # canopen insists on removing it
            known.remove_network()
        remote = self._network.add_node(node, canopen.ObjectDictionary())
        self._unsubscribe(0x80 + node, _emcy_consumer(remote))
        return remote

    def watch(self, node: int) -> NodeWatch:
        """Start to listen to a node's heartbeat and EMCY."""
        watch = NodeWatch(node)
        self._network.subscribe(0x700 + node, watch.on_heartbeat)
        self._network.subscribe(0x80 + node, watch.on_emcy)
        return watch

    def subscribe(self, can_id: int, callback: FrameCallback) -> None:
        """Call back for frames with this id, on the network's thread; callbacks must not raise or wait."""
        self._network.subscribe(can_id, callback)

    def _unsubscribe(self, can_id: int, callback: FrameCallback) -> None:
        self._network.unsubscribe(can_id, callback)  # pyright: ignore[reportUnknownMemberType]  untyped in canopen

    def sent(self, can_id: int) -> int:
        """How many frames with this id have gone out by this connection."""
        return self._network.sent[can_id]

    def send(self, can_id: int, data: bytes) -> None:
        """Send one frame; BusError when the interface refuses."""
        try:
            self._network.send_message(can_id, data)
        except (can.CanError, OSError) as error:
            raise BusError(f"bus {self.settings}: {reason_in_words(error)}") from error

    def ask(self, can_id: int) -> None:
        """Send one remote frame; BusError when the interface refuses."""
        try:
            self._network.send_remote(can_id)
        except (can.CanError, OSError) as error:
            raise BusError(f"bus {self.settings}: {reason_in_words(error)}") from error


def _emcy_consumer(node: canopen.RemoteNode) -> FrameCallback:
    consumer: Any = node.emcy.on_emcy  # pyright: ignore[reportUnknownMemberType, reportUnknownVariableType]
    return consumer
