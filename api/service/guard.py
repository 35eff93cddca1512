"""One ASGI guard in front of pages, REST and WebSocket alike.

It finds out who asks, turns away foreign hosts and foreign origins, checks the page's CSRF token, bounds the
body and writes everything that changes something into the audit log. What a role may do is said by the
routes (access.py).
"""

import logging
from collections import Counter
from collections.abc import Callable
from contextlib import ExitStack
from functools import partial
from typing import Any

import anyio
import anyio.to_thread
from starlette.datastructures import MutableHeaders
from starlette.requests import HTTPConnection, Request
from starlette.responses import JSONResponse
from starlette.types import ASGIApp, Message, Receive, Scope, Send

from api.service.access import (
    CSRF_HEADER,
    CSRF_KEY,
    SIGN_IN_KEY,
    STILL_WELCOME_KEY,
    check_role,
    client_address,
    is_token,
)
from api.service.accounts import LOCAL_OPERATOR, Role, User
from api.service.problems import Problem, problem_answer
from api.service.request_body import body_limit, bounded, check_length, read_over
from api.service.request_origin import came_through_a_proxy, check_host, check_origin
from api.service.route_table import DeclaredRoute
from api.service.settings import ServiceSettings
from api.service.upload_slots import UploadSlots

SAFE_METHODS = frozenset({"GET", "HEAD", "OPTIONS"})
GUARD_THREADS = 8
"""Threads for looking up who asks and writing the audit log."""
WEBSOCKETS_OF_ONE_PERSON = 100
"""At the same time: a wall of screens signed in as one, and no more than a part of the connections."""
POLICY_VIOLATION = 1008
"""WebSocket close code for a refused connection (RFC 6455, 7.4.1)."""
RESPONSE_HEADERS = {
    "X-Content-Type-Options": "nosniff",
    "X-Frame-Options": "DENY",
    "Referrer-Policy": "same-origin",
    "Content-Security-Policy": "default-src 'self'; img-src 'self' data:; style-src 'self' 'unsafe-inline'; "
    "frame-ancestors 'none'; form-action 'self'; base-uri 'self'",
}
"""Sent with every response that does not say otherwise; nothing is loaded from another host."""
OVER_TLS = {"Strict-Transport-Security": "max-age=31536000"}
"""Browsers then ask by https alone, for a year (RFC 6797)."""
NOBODY = User("nobody", Role.VIEWER, "none")
_log = logging.getLogger(__name__)


class Guard:
    """ASGI middleware; needs the session middleware around it and `app.state.service`."""

    def __init__(self, app: ASGIApp) -> None:
        self.app = app
        self._uploads = UploadSlots()
        self._threads = anyio.CapacityLimiter(GUARD_THREADS)
        self._watching: Counter[str] = Counter()

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        if scope["type"] not in ("http", "websocket"):
            await self.app(scope, receive, send)
            return
        connection = HTTPConnection(scope)
        service = connection.app.state.service
        method = scope["method"] if scope["type"] == "http" else ""
        send = _with_headers(send, service.settings, connection.app.state.stop_port)
        try:
            _check_address(connection)
            if method and (stopped := connection.app.state.stop_requests.answer(scope)):
                await JSONResponse(stopped.content, stopped.status)(scope, receive, send)
                return
            check_host(connection, service.settings)
            user = await self._who(connection, service)
            scope["user"] = user
            changes = method != "" and method not in SAFE_METHODS
            if changes or scope["type"] == "websocket":
                check_origin(connection)
            if changes and user is not None and user.via != "token":
                self._check_csrf(connection)
            if scope["type"] == "websocket" and user is None:
                raise Problem(401, "Sign in, or send a bearer token.", {"WWW-Authenticate": "Bearer"})
        except Problem as problem:
            await _refuse(problem, connection, receive, send)
            return
        if scope["type"] == "websocket" and user is not None:
            scope[STILL_WELCOME_KEY] = partial(self._still_welcome, connection, service, user)
            await self._watched_by(user, connection, receive, send)
            return
        if not changes:
            # HEAD is GET without the body, which the server leaves out (RFC 9110, 9.3.2).
            as_read = {**scope, "method": "GET"} if method == "HEAD" else scope
            await self.app(as_read, receive, send)
            return
        await self._changed(connection, service, receive, send)

    async def _in_thread(self, function: Callable[..., Any], *arguments: Any) -> Any:
        """Run in a thread that slow requests, which use the default ones, can never have taken: the stop
        button passes here."""
        return await anyio.to_thread.run_sync(function, *arguments, limiter=self._threads)

    def _check_csrf(self, connection: HTTPConnection) -> None:
        expected = connection.session.get(CSRF_KEY)
        # Without our cookie there is nothing that a browser attached by itself; the origin was checked.
        if expected is not None and not is_token(connection.headers.get(CSRF_HEADER), expected):
            raise Problem(403, f"The header {CSRF_HEADER} is missing or old; load the page again.")

    async def _who(self, connection: HTTPConnection, service) -> User | None:
        scheme, _, secret = connection.headers.get("authorization", "").partition(" ")
        if scheme.lower() == "bearer":
            secret = secret.strip()
            user = await self._in_thread(service.accounts.user_of_token, secret)
            if user is None:
                raise Problem(
                    401, "The bearer token is unknown, expired or revoked.", {"WWW-Authenticate": "Bearer"}
                )
            service.stop_passes.remember(secret, user)
            return user
        if secret := connection.session.get(SIGN_IN_KEY):
            user = await self._in_thread(service.accounts.user_of_sign_in, secret)
            if user is not None:
                service.stop_passes.remember(secret, user)
                return user
        at_this_machine = service.settings.bound_to_loopback and not came_through_a_proxy(connection)
        if at_this_machine and not await self._in_thread(service.accounts.exist):
            service.stop_passes.local_operator = True
            return LOCAL_OPERATOR
        return None

    async def _watched_by(self, user: User, connection: HTTPConnection, receive: Receive, send: Send) -> None:
        """Serve a WebSocket, of which one person has so many at a time."""
        if self._watching[user.name] >= WEBSOCKETS_OF_ONE_PERSON:
            detail = f"{user.name} has {WEBSOCKETS_OF_ONE_PERSON} live views open already; close one."
            await _refuse(Problem(429, detail), connection, receive, send)
            return
        self._watching[user.name] += 1
        try:
            await self.app(connection.scope, receive, send)
        finally:
            self._watching[user.name] -= 1

    async def _still_welcome(self, connection: HTTPConnection, service, user: User) -> bool:
        """Whether who opened a connection that stays open could open it now as well."""
        try:
            now = await self._who(connection, service)
        except Problem:
            return False
        return now is not None and now.name == user.name

    async def _changed(self, connection: HTTPConnection, service, receive: Receive, send: Send) -> None:
        """Let something be changed by who may, and write it into the audit log; who may not is not listened to."""
        scope = connection.scope
        route: DeclaredRoute | None = connection.app.state.route_table.find(scope["method"], scope["path"])
        limit, status = body_limit(route, service.settings), 500

        async def watching_send(message: Message) -> None:
            nonlocal status
            if message["type"] == "http.response.start":
                status = message["status"]
            await send(message)

        try:
            with ExitStack() as slots:
                try:
                    user = scope["user"]
                    if route is not None and route.role is not None:
                        check_role(user, route.role)
                    check_length(connection, limit)
                    if route is not None and route.takes_file:
                        slots.enter_context(self._uploads.taken(user.name))
                except Problem as problem:
                    await _refuse(problem, connection, receive, watching_send)
                    return
                await self.app(scope, bounded(receive, limit), watching_send)
        finally:
            if not _of_no_account(scope, route, status):
                await self._audit(connection, service, route.path if route else scope["path"], status)

    async def _audit(self, connection: HTTPConnection, service, path: str, status: int) -> None:
        scope = connection.scope
        action = f"{scope['method']} {path}"
        # Not even a full disk may keep the stop button from answering.
        try:
            details = scope.get("audit_details")
            append = partial(service.audit.append, client=client_address(connection), details=details)
            await self._in_thread(append, scope.get("user") or NOBODY, action, scope["path"], str(status))
        except Exception:
            _log.exception("the audit log could not be written: %s %s", action, scope["path"])


def _of_no_account(scope: Scope, route: DeclaredRoute | None, status: int) -> bool:
    """Whether a stranger was turned away unheard: strangers must not be able to fill the log, and with it the disk."""
    tried_to_sign_in = route is not None and route.role is None
    return scope.get("user") is None and (not tried_to_sign_in or status in (429, 503))


def _check_address(connection: HTTPConnection) -> None:
    """No name here holds a NUL, and databases and file systems take it each in their own way."""
    if "\x00" in connection.scope["path"] or b"%00" in connection.scope.get("query_string", b""):
        raise Problem(400, "The address holds a NUL character.")


def _with_headers(send: Send, settings: ServiceSettings, stop_port: int | None) -> Send:
    sent = RESPONSE_HEADERS | (OVER_TLS if settings.secure_cookies else {})
    if stop_port is not None:
        sent |= {"Stop-Port": str(stop_port)}

    async def sending(message: Message) -> None:
        if message["type"] == "http.response.start":
            headers = MutableHeaders(scope=message)
            for name, value in sent.items():
                headers.setdefault(name, value)
        await send(message)

    return sending


async def _refuse(problem: Problem, connection: HTTPConnection, receive: Receive, send: Send) -> None:
    scope = connection.scope
    if scope["type"] == "websocket":
        await send({"type": "websocket.close", "code": POLICY_VIOLATION, "reason": problem.detail[:120]})
        return
    if scope["method"] not in SAFE_METHODS:
        await read_over(receive)
    response = await problem_answer(Request(scope), problem)
    await response(scope, receive, send)
