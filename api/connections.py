"""The connections that the event loop serves: how many, from where, and how long each may keep it waiting.

A connection is admitted while there is room, overall and for its address; where there is none, the one that has been idle
longest makes room. Who begins a request and does not go on with it is shown out. The acceptor's thread admits, the event
loop serves and sweeps; what both use are sets and flags that change in one step.
"""

import asyncio
import contextlib
import logging
import select
import socket
import ssl
import time
from collections import Counter
from collections.abc import Callable, Iterator
from dataclasses import asdict, dataclass, field

import h11
from starlette.types import Receive, Scope, Send
from uvicorn import Config
from uvicorn.protocols.http.h11_impl import H11Protocol
from uvicorn.server import ServerState

from api.request_head import Objection, head_of, objection_to
from api.service.stop_requests import STOP_REQUEST
from api.turnstile import Turnstile
from api.written_answer import written_answer

HEAD_TIMEOUT = 10.0
"""s that a connection may take for the head of a request, from its begin or from the answer before"""
BODY_TIMEOUT = 30.0
"""s that we listen for a body that was announced and does not come"""
LEAST_RATE = 1000.0
"""bytes of a body that buy a second more: who sends less holds a place and says nothing"""
SWEEP_EVERY = 1.0
"""s between looks for those who keep us waiting"""
MOST_CONNECTIONS = 512
"""at the same time; a laboratory with 60 viewers uses some 200. Below 1024, beyond which select() fails in libraries."""
AnswerStop = Callable[[bytes, str], bytes | None]
"""The answer to the stop with this head, from this address; None where it is no stop, or not one to be judged at once"""
_log = logging.getLogger(__name__)


@dataclass(eq=False)
class Link:
    """One admitted connection.

    prefix : what was read of it before it was admitted
    shown_out : it has to go, and no longer counts
    patience : s that we still listen for the body under way
    """

    socket: socket.socket
    address: str
    prefix: bytes = b""
    protocol: "LinkedProtocol | None" = None
    shown_out: bool = False
    idle_since: float = field(default_factory=time.monotonic)
    patience: float = BODY_TIMEOUT

    @property
    def gone(self) -> bool:
        """Whether it is closed, or on its way out."""
        return self.shown_out or self.socket.fileno() == -1

    def peek(self) -> bytes:
        """What has come and was not read yet, at most a request's head; without reading it. Needs no descriptor."""
        descriptor = self.socket.fileno()
        poller = select.poll()
        try:
            poller.register(descriptor, select.POLLIN)
            if not poller.poll(0):
                return b""
            seen = socket.socket(fileno=descriptor)
        except (OSError, ValueError):
            return b""
        try:
            return seen.recv(8192, socket.MSG_PEEK | socket.MSG_DONTWAIT)
        except OSError:
            return b""
        finally:
            seen.detach()


class LinkedProtocol(H11Protocol):
    """uvicorn's HTTP protocol that says when it waits, begins with what was read before, and lets a request begin when it is
    its turn and its head may be parsed."""

    def __init__(self, link: Link, connections: "Connections", turnstile: Turnstile) -> None:
        super().__init__(connections.config, connections.state, connections.lifespan_state)
        self.link = link
        self.upgraded = False
        self._answers, self.app = self.app, self._counted
        self._connections = connections
        self._turnstile = turnstile
        self._queued = False
        self._refused = False
        self._gone = False
        self._under_way = 0

    @property
    def waits(self) -> bool:
        """Whether the next thing is a request."""
        return not self.upgraded and (self.cycle is None or self.cycle.response_complete)

    def connection_made(self, transport: asyncio.Transport) -> None:  # type: ignore[override]
        """Read first what the acceptor had read."""
        super().connection_made(transport)
        prefix, self.link.prefix = self.link.prefix, b""
        if prefix:
            self.data_received(prefix)

    def connection_lost(self, exc: Exception | None) -> None:
        """Whoever waited for its turn waits no more; what is under way goes on for nobody."""
        super().connection_lost(exc)
        self._gone = True
        self._turnstile.leave(self._begin)
        for _ in range(self._under_way):
            self._turnstile.abandon()
        self._connections.forget(self.link)

    async def _counted(self, scope: Scope, receive: Receive, send: Send) -> None:
        """The application, with its requests counted while they are under way."""
        if self._gone:
            return  # before its task's first step: nothing was begun
        self._under_way += 1
        try:
            await self._answers(scope, receive, send)
        finally:
            self._under_way -= 1
            if self._gone:
                self._turnstile.end_abandoned()

    def data_received(self, data: bytes) -> None:
        """What comes buys time; a new request has all of it, and after a refusal nothing counts."""
        if self._refused:
            return
        bought = self.link.patience + len(data) / LEAST_RATE
        self.link.patience = BODY_TIMEOUT if self.waits else min(BODY_TIMEOUT, bought)
        super().data_received(data)

    def handle_events(self) -> None:
        """Parse what has come; the head of a request waits for its turn."""
        if self._queued:
            return
        if self.conn.their_state is not h11.IDLE:
            super().handle_events()
            return
        read = self.conn.trailing_data[0]
        head = head_of(read)
        if (objection := objection_to(head or read)) is not None:
            self._refuse(objection)
        elif head is None:
            super().handle_events()  # which says so where it cannot become one
        else:
            is_stop = STOP_REQUEST.match(head) is not None
            if is_stop and (answer := self._connections.answer_stop(head, self.link.address)) is not None:
                self._end_with(answer)
                return
            self._queued = True
            self._connections.now_busy(self.link)
            self.flow.pause_reading()
            self._turnstile.wait(self._begin, is_stop=is_stop)

    def _begin(self) -> None:
        """It is this request's turn."""
        self._queued = False
        if not self.transport.is_closing():
            self.flow.resume_reading()
            super().handle_events()

    def _refuse(self, objection: Objection) -> None:
        content = {"type": "about:blank", "title": "Refused", **asdict(objection)}
        self._end_with(written_answer(objection.status, content))

    def _end_with(self, answer: bytes) -> None:
        """Send the last answer of this connection."""
        self.transport.write(answer)
        if self.transport.can_write_eof():
            # Closed with something unread, it would be reset, and the answer lost; the sweep ends who stays.
            self._refused = True
            try:
                self.transport.write_eof()
            except OSError:
                self.transport.abort()  # reset by the other side meanwhile
        else:
            self.transport.close()

    def handle_websocket_upgrade(self, event) -> None:
        """From here on another protocol has the connection."""
        self.upgraded = True
        super().handle_websocket_upgrade(event)

    def on_response_complete(self) -> None:
        """The connection waits for its next request."""
        self._connections.now_idle(self.link)
        super().on_response_complete()


class Connections:
    """All admitted connections of one server.

    most : at the same time; from one address at most half of them

    A crowd makes the acceptor ask for room for each newcomer: what that needs is counted as it changes, not looked for.
    """

    def __init__(self, config: Config, state: ServerState, most: int) -> None:
        self.config = config
        self.state = state
        self.lifespan_state: dict = {}
        self.answer_stop: AnswerStop = lambda _head, _address: None
        """Of a stop that came on a connection that the event loop has; the acceptor's."""
        self._most = most
        self._links: set[Link] = set()  # with the count of each address, the acceptor's alone to change
        self._of_address: Counter[str] = Counter()
        self._left: set[Link] = set()
        self._idle: dict[
            Link, None
        ] = {}  # since when they are, the first first; the event loop's alone to change
        self._loop: asyncio.AbstractEventLoop | None = None
        self._turnstile: Turnstile | None = None
        self._sweeper: asyncio.TimerHandle | None = None
        self._adopting: set[asyncio.Task[None]] = set()

    def start(self, lifespan_state: dict) -> None:
        """Serve from now on, in the running event loop."""
        self._loop = asyncio.get_running_loop()
        self._turnstile = Turnstile(self._loop)
        self.lifespan_state = lifespan_state
        self._sweep()

    def end(self) -> None:
        """Sweep no more."""
        if self._sweeper is not None:
            self._sweeper.cancel()

    # --- in the acceptor's thread

    def admit(self, link: Link, tls: ssl.SSLContext | None = None) -> bool:
        """Give a connection to the event loop if there is room; a TLS handshake is made there."""
        if self._loop is None or self._loop.is_closed() or not self._make_room(link.address):
            return False
        self._links.add(link)
        self._of_address[link.address] += 1
        self._loop.call_soon_threadsafe(self._begin, link, tls)
        return True

    def served(self) -> Iterator[Link]:
        """Those that are there."""
        return (link for link in list(self._links) if not link.gone)

    def show_out_longest_idle(self) -> bool:
        """Close the connection that has waited longest; False if none waits."""
        return self._show_out_idle(None)

    def _make_room(self, address: str) -> bool:
        while self._left:
            self._count_out(self._left.pop())
        if self._of_address[address] >= self._most // 2:
            return self._show_out_idle(address)
        return len(self._links) < self._most or self._show_out_idle(None)

    def _show_out_idle(self, address: str | None) -> bool:
        """Likewise, of those from this address."""
        for link in list(self._idle):
            if self._loop is not None and not link.gone and address in (None, link.address):
                link.shown_out = True
                self._count_out(link)
                self._loop.call_soon_threadsafe(self._close, link)
                return True
        return False

    def _count_out(self, link: Link) -> None:
        if link in self._links:
            self._links.remove(link)
            self._of_address[link.address] -= 1
            if not self._of_address[link.address]:
                del self._of_address[link.address]

    # --- in the event loop

    def now_idle(self, link: Link) -> None:
        """It waits for a request from now on."""
        link.idle_since = time.monotonic()
        self._idle.pop(link, None)
        self._idle[link] = None

    def now_busy(self, link: Link) -> None:
        """It has asked; whoever waits for an answer makes room for nobody."""
        self._idle.pop(link, None)

    def forget(self, link: Link) -> None:
        """It is closed."""
        self._idle.pop(link, None)
        self._left.add(link)

    def _begin(self, link: Link, tls: ssl.SSLContext | None) -> None:
        task = asyncio.ensure_future(self._adopt(link, tls))
        self._adopting.add(task)
        task.add_done_callback(self._adopting.discard)

    async def _adopt(self, link: Link, tls: ssl.SSLContext | None) -> None:
        assert self._loop is not None
        turnstile = self._turnstile
        assert turnstile is not None
        self.now_idle(link)  # from here on: a crowd that never goes on with its TLS handshake makes room too

        def protocol() -> LinkedProtocol:
            link.protocol = LinkedProtocol(link, self, turnstile)
            return link.protocol

        try:
            await self._loop.connect_accepted_socket(
                protocol, link.socket, ssl=tls, ssl_handshake_timeout=HEAD_TIMEOUT if tls else None
            )
        except (OSError, ssl.SSLError):
            self.forget(link)
            link.socket.close()  # it went before it was there, or speaks no TLS

    def _sweep(self) -> None:
        assert self._loop is not None
        now = time.monotonic()
        for link in list(self._links):
            if link.socket.fileno() == -1:
                self.forget(link)
            elif link.protocol is not None and self._keeps_us_waiting(link, link.protocol, now):
                self._close(link)
        self._sweeper = self._loop.call_later(SWEEP_EVERY, self._sweep)

    @staticmethod
    def _keeps_us_waiting(link: Link, protocol: LinkedProtocol, now: float) -> bool:
        if protocol.upgraded:
            return False
        if protocol.waits:
            return now - link.idle_since > HEAD_TIMEOUT
        # Where it is we who do not read, nothing can come.
        slow = protocol.cycle.more_body and not protocol.flow.read_paused
        if slow:
            link.patience -= SWEEP_EVERY
        return slow and link.patience < 0

    def _close(self, link: Link) -> None:
        link.shown_out = True
        if link.protocol is not None and link.protocol.transport is not None:
            link.protocol.transport.abort()
            return
        # Its TLS handshake is not over, or has not begun: that ends with the connection.
        with contextlib.suppress(OSError):
            link.socket.shutdown(socket.SHUT_RDWR)
