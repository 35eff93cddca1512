"""python-can's virtual interface with a short cut for nodes that live in this process.

A simulated session is hundreds of thousands of SYNC cycles. Over python-can's own `virtual` bus each frame
is deep-copied into a queue per listener and wakes a thread there; measured, that alone takes longer than
drive and mechanism together. `InProcessBus` is a member of the same virtual channels (any
`can.Bus(interface="virtual")` in the process hears and is heard), but between its own kind a frame is a
tuple, a listener's filter acts when the frame is delivered, and a node may be *served*: its handler is
called by the thread that sends.

Order on the bus: frames are delivered one at a time, each to every listener, in the order in which they
were sent. A frame that a handler sends while it is being served waits until the frame before it has reached
everybody.
"""

import threading
import time
from collections import deque
from collections.abc import Callable
from typing import Any

import can
from can.interfaces.virtual import VirtualBus

from drivers import frames

Handler = Callable[[int, bytes], None]
RemoteHandler = Callable[[int], None]
Clock = Callable[[], int]

# stamp in ns, CAN id, data, flags (drivers/frames.py)
Frame = tuple[int, int, bytes, int]


class _Channel:
    """One virtual channel: its listeners, its clock, and the frames on their way."""

    def __init__(self) -> None:
        self.clock: Clock = time.time_ns
        self.on_the_way: deque[tuple[Frame, _Inbox]] = deque()
        self.dispatching = threading.Lock()
        self.listeners: list[Any] = []  # python-can's list of queues, ours among them
        self.failure: str | None = None


_channels: dict[str, _Channel] = {}
_channels_lock = threading.Lock()


class _Inbox:
    """Frames that wait for one listener; stands where python-can's VirtualBus has its queue."""

    def __init__(self, bus: "InProcessBus", receives_own: bool):
        self.bus = bus
        self.receives_own = receives_own
        self.waiting_frames: deque[Frame] = deque()
        self.handler: Handler | None = None
        self.remote_handler: RemoteHandler | None = None
        self.passes: dict[int, bool] = {}  # what the filters say, by id; asked once per id
        self._arrived = threading.Condition()
        self._readers = 0

    def deliver(self, frame: Frame) -> None:
        can_id = frame[1]
        passes = self.passes.get(can_id)
        if passes is None:
            passes = self.passes[can_id] = self.bus.passes(can_id, bool(frame[3] & frames.EXTENDED))
        if not passes:
            return
        if self.handler is not None:
            if not frame[3] & frames.REMOTE:
                self.handler(can_id, frame[2])
            elif self.remote_handler is not None:
                self.remote_handler(can_id)
            return
        self.waiting_frames.append(frame)
        if self._readers:
            with self._arrived:
                self._arrived.notify()

    def wake(self) -> None:
        """Let whoever waits look again."""
        with self._arrived:
            self._arrived.notify_all()

    def put(self, item: can.Message, block: bool = True, timeout: float | None = None) -> None:
        """A frame from python-can's own VirtualBus on the same channel, which tells every listener itself."""
        self.deliver(frame_of(item, round(item.timestamp * 1e9)))

    def get(self, timeout: float | None) -> Frame | None:
        if not self.waiting_frames:
            if timeout is not None and timeout <= 0:
                return None
            with self._arrived:
                self._readers += 1
                try:
                    self._arrived.wait_for(lambda: self.waiting_frames or self.bus.failed, timeout)
                finally:
                    self._readers -= 1
        try:
            return self.waiting_frames.popleft()
        except IndexError:
            return None


def frame_of(message: can.Message, stamp: int) -> Frame:
    """A python-can message as a frame."""
    flags = (
        frames.EXTENDED * message.is_extended_id
        | frames.REMOTE * message.is_remote_frame
        | frames.ERROR * message.is_error_frame
        | frames.FD * message.is_fd
        | frames.BITRATE_SWITCH * message.bitrate_switch
        | frames.ERROR_STATE * message.error_state_indicator
    )
    return stamp, message.arbitration_id, bytes(message.data), flags


def remote_frame(can_id: int) -> can.Message:
    """A remote frame that asks for the one byte of node guarding (CiA 301, 7.2.8.3.2.1)."""
    return can.Message(arbitration_id=can_id, is_extended_id=False, is_remote_frame=True, dlc=1)


def _message_of(frame: Frame, channel: str, sent_by_us: bool) -> can.Message:
    stamp, can_id, data, flags = frame
    return can.Message(
        timestamp=stamp * 1e-9,
        arbitration_id=can_id,
        is_extended_id=bool(flags & frames.EXTENDED),
        is_remote_frame=bool(flags & frames.REMOTE),
        is_error_frame=bool(flags & frames.ERROR),
        is_fd=bool(flags & frames.FD),
        bitrate_switch=bool(flags & frames.BITRATE_SWITCH),
        error_state_indicator=bool(flags & frames.ERROR_STATE),
        data=data,
        channel=channel,
        is_rx=not sent_by_us,
    )


class InProcessBus(VirtualBus):
    """A member of a virtual channel of this process.

    channel              : name shared by all members
    can_filters          : python-can's filters; applied at delivery
    receive_own_messages : whether frames sent here come back here, flagged OWN
    """

    def __init__(
        self,
        channel: str,
        can_filters: Any = None,
        receive_own_messages: bool = False,
    ):
        super().__init__(channel=channel, receive_own_messages=receive_own_messages, can_filters=can_filters)
        self._name = channel
        self._inbox = _Inbox(self, receive_own_messages)
        with _channels_lock:
            self._bus = _channels.setdefault(channel, _Channel())
            self._bus.listeners = self.channel
            self.channel[self.channel.index(self.queue)] = self._inbox  # type: ignore[call-overload]
            self.queue = self._inbox  # type: ignore[assignment]

    @property
    def failed(self) -> bool:
        """Whether the channel is broken."""
        return self._bus.failure is not None

    def use_clock(self, clock: Clock) -> None:
        """Stamp the frames of this channel with `clock` (ns) instead of the system's time."""
        self._bus.clock = clock

    def serve(self, handler: Handler, remote_handler: RemoteHandler | None = None) -> None:
        """Call `handler(can_id, data)` for every data frame, on the sender's thread, instead of queueing it.

        remote_handler : called with the id of every remote frame; without one they are passed over
        """
        self._inbox.remote_handler = remote_handler
        self._inbox.handler = handler

    def send_frame(self, can_id: int, data: bytes) -> None:
        """Send a data frame with an 11-bit id, without building a `can.Message`."""
        self.forward((self._bus.clock(), can_id, data, 0), self._inbox)

    def take(self) -> list[Frame]:
        """All frames that wait, oldest first.

        Raises can.CanOperationError when the channel has failed.
        """
        if self._bus.failure is not None:
            raise can.CanOperationError(self._bus.failure)
        waiting = self._inbox.waiting_frames
        return [waiting.popleft() for _ in range(len(waiting))]

    def pass_on(self, frame: Frame) -> None:
        """Deliver a frame that came from elsewhere, with the stamp it has, to all others."""
        self.forward(frame, self._inbox)

    def fail(self, reason: str) -> None:
        """The channel is broken: whoever receives or sends on it is told so."""
        self._bus.failure = reason
        for listener in tuple(self._bus.listeners):
            if isinstance(listener, _Inbox):
                listener.wake()

    def passes(self, can_id: int, extended: bool) -> bool:
        """Whether the filters let this id through."""
        return self._matches_filters(can.Message(arbitration_id=can_id, is_extended_id=extended))

    def set_filters(self, filters: Any = None) -> None:
        """As python-can's: a list of {can_id, can_mask, extended}; None lets everything through."""
        super().set_filters(filters)
        if hasattr(self, "_inbox"):
            self._inbox.passes.clear()

    def forward(self, frame: Frame, sender: _Inbox) -> None:
        """Deliver a frame, or leave it to the thread that is delivering already.

        Nobody waits for a lock here: a node that answers from inside its handler, and a heartbeat thread that
        sends meanwhile, can neither deadlock nor overtake.
        """
        bus = self._bus
        if bus.failure is not None:
            raise can.CanOperationError(bus.failure)
        bus.on_the_way.append((frame, sender))
        while bus.on_the_way and bus.dispatching.acquire(blocking=False):
            try:
                while bus.on_the_way:
                    self._deliver(*bus.on_the_way.popleft())
            finally:
                bus.dispatching.release()

    def delivered(self, timeout: float) -> bool:
        """Wait until every frame sent so far, and what was sent in answer, has reached everybody; False when not.

        Another thread, a heartbeat's, may be the one that delivers, and may be held up there: `send_frame` has then
        returned before the nodes have heard of the frame. Not for a handler, which would wait for itself.
        """
        bus = self._bus
        end = time.monotonic() + timeout
        while bus.on_the_way or bus.dispatching.locked():
            if not bus.dispatching.acquire(timeout=max(0.0, end - time.monotonic())):
                return False
            try:
                while bus.on_the_way:
                    self._deliver(*bus.on_the_way.popleft())
            finally:
                bus.dispatching.release()
        return True

    def _deliver(self, frame: Frame, sender: _Inbox) -> None:
        for listener in tuple(self._bus.listeners):
            if isinstance(listener, _Inbox):
                if listener is not sender:
                    listener.deliver(frame)
                elif listener.receives_own:
                    listener.deliver((frame[0], frame[1], frame[2], frame[3] | frames.OWN))
            else:
                listener.put(_message_of(frame, self._name, sent_by_us=False))

    def send(self, msg: can.Message, timeout: float | None = None) -> None:
        """Deliver a message to all other members before returning, unless another thread is delivering; then that one does.

        Raises can.CanOperationError while the bus is made to fail.
        """
        self._check_if_open()
        self.forward(frame_of(msg, self._bus.clock()), self._inbox)

    def shutdown(self) -> None:
        """Leave the channel; the last member of a channel ends it. Harmless when repeated."""
        super().shutdown()
        with _channels_lock:
            if not self.channel and _channels.get(self._name) is self._bus:
                del _channels[self._name]

    def _recv_internal(self, timeout: float | None) -> tuple[can.Message | None, bool]:
        self._check_if_open()
        frame = self._inbox.get(timeout)
        if frame is None and self._bus.failure is not None:
            raise can.CanOperationError(self._bus.failure)
        if frame is None:
            return None, True
        return _message_of(frame, self._name, sent_by_us=bool(frame[3] & frames.OWN)), True
