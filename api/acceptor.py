"""Accepts connections in a thread of its own, and answers stops there, whatever the event loop is doing.

Every connection begins here. The thread reads until the head of its first request is there: a stop is answered at once (by
`api.service.stop_requests`), everything else is handed to the event loop, together with what was read. Who only connects and
says nothing costs a place in a short waiting room, in which newcomers displace the oldest of the address that has most; so
no number of idle connections keeps a stop out. The sockets and a few descriptors held back are opened at the start, so
that an answer needs no new one.

A connection that the event loop has already is looked into, without reading, while the loop is frozen: a stop that has
come there is obeyed, though its answer must wait for the loop. Under TLS only its own end can read a connection. There the
stop has a port of its own (`Door.STOP`), where this thread does the TLS; while the event loop is frozen, it does so for
newcomers at the service's port too.

`coulomb stop` comes by a socket in the data folder (`Door.LOCAL`), which nobody but the service's own user can open.
"""

import contextlib
import logging
import os
import selectors
import socket
import ssl
import struct
import threading
import time
from collections import Counter
from collections.abc import Callable
from dataclasses import dataclass, field
from enum import Enum
from typing import Any
from urllib.parse import urlsplit

import h11
from starlette.types import Scope

from api.connections import HEAD_TIMEOUT, Connections, Link
from api.descriptors import OUT_OF_DESCRIPTORS, Reserve
from api.request_head import head_of, in_origin_form, objection_to, request_of
from api.service.accounts import Role, User
from api.service.problems import Problem
from api.service.pulse import PERIOD, Pulse
from api.service.stop_requests import STOP_REQUEST, StopAnswer, StopOrder, StopRequests, problem_of
from api.written_answer import written_answer

WAITING_ROOM = 128
"""connections at one door of which no whole request has come yet"""
HEAD_OF_A_STOP = 16 * 1024
"""bytes; a stop is far shorter, everything longer is for the event loop to judge"""
LINGER = 1.0
"""s that who was answered has to read the answer and close"""
FROZEN = 0.25
"""s without a turn of the event loop after which its connections are looked into"""
BACKLOG = 1024
"""connections that the kernel keeps until they are accepted"""
READS = 4
"""reads of one connection before others have their turn"""
BURST = 64
"""connections accepted before those that wait are looked at again"""
_PEER = struct.Struct("3i")
_log = logging.getLogger(__name__)


class Door(Enum):
    """What a listening socket is for."""

    SERVICE = "everything"
    STOP = "stops alone"
    LOCAL = "stops from this machine, by the service's own user"


@dataclass
class Listener:
    """A listening socket; `tls` where it answers by https."""

    socket: socket.socket
    door: Door
    tls: ssl.SSLContext | None = None


@dataclass(eq=False)
class _Visitor:
    """A connection whose first request is not there yet, or that was answered and is about to close."""

    socket: socket.socket
    address: str
    listener: Listener
    since: float = field(default_factory=time.monotonic)
    handshaken: bool = True
    read: bytearray = field(default_factory=bytearray)
    answered: bool = False
    listened_to: bool = False


class Acceptor:
    """The thread and its sockets.

    listeners   : open and bound already
    stops       : answers them
    session_of  : the content of our cookie in a Cookie header
    connections : those that the event loop serves
    loop_pulse  : the event loop's
    """

    def __init__(
        self,
        listeners: list[Listener],
        stops: StopRequests,
        session_of: Callable[[str], dict[str, Any]],
        connections: Connections,
        loop_pulse: Pulse,
    ) -> None:
        self._listeners = listeners
        self._stops = stops
        self._session_of = session_of
        self._connections = connections
        self._loop_pulse = loop_pulse
        self.pulse = Pulse()
        self._visitors: set[_Visitor] = set()
        self._obeyed: dict[Link, bytes] = {}
        self._reserve = Reserve()
        self._ended = False
        self._selector = selectors.DefaultSelector()
        self._wake, self._woken = socket.socketpair()
        self._selector.register(self._woken, selectors.EVENT_READ)
        for listener in listeners:
            listener.socket.setblocking(False)
            self._selector.register(listener.socket, selectors.EVENT_READ, listener)
        connections.answer_stop = self.stop_on_kept_connection
        self._thread = threading.Thread(target=self._run, name="acceptor", daemon=True)

    def start(self) -> None:
        """Accept from now on."""
        self.pulse.beat()
        self._thread.start()

    def close(self) -> None:
        """Accept no more, and close the listening sockets."""
        self._ended = True
        self._wake.send(b".")
        if self._thread.ident is not None:
            self._thread.join()
        for visitor in list(self._visitors):
            self._leave(visitor)
        for listener in self._listeners:
            listener.socket.close()
        for each in (self._wake, self._woken, self._selector):
            each.close()
        self._reserve.close()

    def _run(self) -> None:
        while not self._ended:
            try:
                self._turn()
            except Exception:
                # One bad connection never ends the thread that answers the stop button.
                _log.exception("a connection could not be dealt with")
            self.pulse.beat()

    def _turn(self) -> None:
        for key, _events in self._selector.select(PERIOD):
            if isinstance(key.data, Listener):
                self._accept(key.data)
            elif isinstance(key.data, _Visitor):
                self._hear(key.data)
        now = time.monotonic()
        for visitor in list(self._visitors):
            if now - visitor.since > (LINGER if visitor.answered else HEAD_TIMEOUT):
                self._leave(visitor)
        self._reserve.refill()
        if self._loop_is_frozen:
            self._look_into_connections()
        elif self._obeyed:
            self._obeyed.clear()

    @property
    def _loop_is_frozen(self) -> bool:
        return self._loop_pulse.age > FROZEN

    # --- newcomers

    def _accept(self, listener: Listener) -> None:
        for _ in range(BURST):
            try:
                connection, address = listener.socket.accept()
            except BlockingIOError:
                return
            except OSError as error:
                if error.errno not in OUT_OF_DESCRIPTORS:
                    return  # it went before it was accepted
                if not self._make_room():
                    return
                continue
            connection.setblocking(False)
            self._welcome(connection, address, listener)

    def _make_room(self) -> bool:
        """There are no descriptors left: those who wait longest go, then what is held back."""
        for listener in self._listeners:  # the service's own first, the stop's after it
            if any(visitor.listener is listener for visitor in self._visitors):
                self._leave(self._longest_waiting(listener))
                return True
        self._connections.show_out_longest_idle()
        return self._reserve.give_up_one()

    def _welcome(self, connection: socket.socket, address: Any, listener: Listener) -> None:
        with contextlib.suppress(OSError):  # a Unix socket has none
            connection.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
        visitor = _Visitor(connection, address[0] if isinstance(address, tuple) else "", listener)
        if listener.tls is not None:
            if listener.door is Door.SERVICE and not self._loop_is_frozen:
                if not self._connections.admit(Link(connection, visitor.address), listener.tls):
                    connection.close()
                return
            visitor.socket = listener.tls.wrap_socket(
                connection, server_side=True, do_handshake_on_connect=False
            )
            visitor.handshaken = False
        # A room for each door: a crowd at the service's keeps nobody from the stop's.
        if sum(each.listener is listener for each in self._visitors) >= WAITING_ROOM:
            self._leave(self._longest_waiting(listener))
        self._visitors.add(visitor)
        self._hear(visitor)  # what it says has mostly come with it
        if visitor in self._visitors:
            self._listen_to(visitor)

    def _listen_to(self, visitor: _Visitor) -> None:
        if not visitor.listened_to:
            self._selector.register(visitor.socket, selectors.EVENT_READ, visitor)
            visitor.listened_to = True

    def _listen_no_more(self, visitor: _Visitor) -> None:
        if visitor.listened_to:
            visitor.listened_to = False
            self._selector.unregister(visitor.socket)

    def _longest_waiting(self, listener: Listener) -> _Visitor:
        """At this door the oldest of the address that has most, so that one crowd displaces itself before anybody else."""
        here = [visitor for visitor in self._visitors if visitor.listener is listener]
        counted = Counter(visitor.address for visitor in here)
        return max(here, key=lambda each: (counted[each.address], -each.since))

    def _leave(self, visitor: _Visitor) -> None:
        self._visitors.discard(visitor)
        self._listen_no_more(visitor)
        visitor.socket.close()

    # --- what they say

    def _hear(self, visitor: _Visitor) -> None:
        try:
            if not visitor.handshaken:
                visitor.socket.do_handshake()  # type: ignore[attr-defined]
                visitor.handshaken = True
            for _ in range(READS):
                came = visitor.socket.recv(HEAD_OF_A_STOP)
                if not came:
                    self._leave(visitor)
                    return
                if not visitor.answered:
                    visitor.read += came
                    if head_of(visitor.read) is not None or len(visitor.read) >= HEAD_OF_A_STOP:
                        self._judge(visitor)
                        if visitor not in self._visitors:
                            return
        except (BlockingIOError, ssl.SSLWantReadError, ssl.SSLWantWriteError):
            return
        except OSError:
            self._leave(visitor)

    def _judge(self, visitor: _Visitor) -> None:
        """The head of the first request is there, or as much of it as no stop has."""
        head = bytes(visitor.read)
        if (objection := objection_to(head_of(head) or head)) is not None:
            # Here, where it costs one look at its bytes: the event loop, and a connection's way into it, cost ten times that.
            self._refuse(visitor, Problem(objection.status, objection.detail), None)
            return
        door = visitor.listener.door
        # What is no stop, the loop parses.
        request = request_of(head) if door is not Door.SERVICE or STOP_REQUEST.match(head) else None
        if request is not None:
            answer = self._stopped(request, visitor.address, visitor.listener, visitor.socket)
            if answer is not None:
                self._answer(visitor, answer, request)
                return
        if door is not Door.SERVICE:
            self._refuse(visitor, _not_here(request), request)
        elif visitor.listener.tls is not None:
            # Its TLS is here, where nobody but the stop is served, and will not be the loop's any more.
            self._refuse(
                visitor, Problem(503, "The service does not answer just now; only a stop does."), request
            )
        else:
            self._hand_over(visitor, head)

    def _stopped(
        self, request: h11.Request, address: str, listener: Listener, local: socket.socket | None = None
    ) -> StopAnswer | None:
        scope = _scope_of(request, address)
        if listener.door is Door.LOCAL and local is not None:
            order, user = StopOrder.of(scope["method"], scope["path"]), _peer(local)
            return None if order is None or user is None else self._stops.obey(order, user, scope["path"], "")
        cookies = b"; ".join(value for name, value in scope["headers"] if name == b"cookie")
        scope["session"] = self._session_of(cookies.decode("latin-1"))
        try:
            return self._stops.answer(scope, any_port=listener.door is Door.STOP)
        except Problem as problem:
            return StopAnswer(problem.status, problem_of(problem))

    def _hand_over(self, visitor: _Visitor, head: bytes) -> None:
        link = Link(visitor.socket, visitor.address, head)
        # Before the event loop has it, which registers it with a selector of its own.
        self._listen_no_more(visitor)
        if self._connections.admit(link):
            self._visitors.discard(visitor)
        else:
            self._listen_to(visitor)
            self._refuse(visitor, Problem(503, "There are too many connections; try again."), None)

    # --- answers

    def _refuse(self, visitor: _Visitor, problem: Problem, request: h11.Request | None) -> None:
        self._answer(visitor, StopAnswer(problem.status, problem_of(problem)), request)

    def _answer(self, visitor: _Visitor, answer: StopAnswer, request: h11.Request | None) -> None:
        """Send it and let the other side close; a few hundred bytes always fit into an empty socket."""
        visitor.answered, visitor.since = True, time.monotonic()
        visitor.socket.send(_response(answer, visitor.listener, request))
        if visitor.listener.tls is None:
            visitor.socket.shutdown(socket.SHUT_WR)

    # --- connections that the event loop has

    def stop_on_kept_connection(self, head: bytes, address: str) -> bytes | None:
        """Obey a stop whose head the event loop has just read: it may freeze before it comes to its turn. The answer; None where
        it is for the loop to judge."""
        request = request_of(head)
        listener = self._listeners[0]
        answer = None if request is None else self._stopped(request, address, listener)
        return None if answer is None else _response(answer, listener, request)

    def _look_into_connections(self) -> None:
        """Obey a stop that has come to the event loop, which cannot read it now."""
        for link in self._connections.served():
            head = b"" if self._listeners[0].tls else link.peek()
            if head_of(head) is None or self._obeyed.get(link) == head:
                continue
            self._obeyed[link] = head
            request = request_of(head)
            if request is not None:
                self._stopped(request, link.address, self._listeners[0])


def _response(answer: StopAnswer, listener: Listener, request: h11.Request | None) -> bytes:
    """The answer as it is sent."""
    later = ["Retry-After: 1"] if answer.status == 503 else []
    return written_answer(answer.status, answer.content, *later, *_cross_origin(listener, request))


def _scope_of(request: h11.Request, address: str) -> Scope:
    """The request as the event loop would have it."""
    target = request.target.partition(b"?")[0]
    return in_origin_form(
        {
            "type": "http",
            "method": request.method.decode("ascii"),
            "path": target.decode("ascii"),
            "raw_path": target,
            "query_string": b"",
            "headers": [(name.lower(), value) for name, value in request.headers],
            "client": (address, 0),
        }
    )


def _not_here(request: h11.Request | None) -> Problem:
    """Why a door that is for stops alone did not stop."""
    scope = None if request is None else _scope_of(request, "")
    if scope is None or StopOrder.of(scope["method"], scope["path"]) is None:
        return Problem(404, "Here is only the stop: POST to /pages/stop, /rigs/RIG/stop or a session's stop.")
    detail = "Nothing was stopped: nothing has moved under this name since the service began, or you are not signed in."
    return Problem(404, detail)


def _cross_origin(listener: Listener, request: h11.Request | None) -> list[str]:
    """Headers that let our own page, which came from the service's port, read an answer of the stop's port."""
    headers = {name.lower(): value.decode("latin-1") for name, value in request.headers} if request else {}
    origin, host = headers.get(b"origin"), headers.get(b"host", "")
    if listener.door is not Door.STOP or origin is None or not origin.isprintable():
        return []
    if urlsplit(origin).hostname != urlsplit("//" + host).hostname:
        return []
    return [
        f"Access-Control-Allow-Origin: {origin}",
        "Access-Control-Allow-Credentials: true",
        "Vary: Origin",
    ]


def _peer(connection: socket.socket) -> User | None:
    """Who is at the other end of a Unix socket; None unless it is our own user, or root."""
    raw = connection.getsockopt(socket.SOL_SOCKET, socket.SO_PEERCRED, _PEER.size)
    _process, uid, _group = _PEER.unpack(raw)
    return User(f"the terminal (user {uid})", Role.OPERATOR, "local") if uid in (0, os.geteuid()) else None
