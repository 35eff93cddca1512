"""One ASGI guard in front of pages, REST and WebSocket alike.

It finds out who asks, turns away foreign hosts and foreign origins, checks the page's CSRF token, bounds the
body and writes everything that changes something into the audit log. What a role may do is said by the
routes (access.py).
"""

import logging
from collections.abc import Callable
from functools import partial
from typing import Any

import anyio
import anyio.to_thread
from starlette.datastructures import MutableHeaders
from starlette.exceptions import HTTPException
from starlette.requests import HTTPConnection
from starlette.responses import JSONResponse
from starlette.types import ASGIApp, Message, Receive, Scope, Send

from api.service.access import CSRF_HEADER, CSRF_KEY, SIGN_IN_KEY, STILL_WELCOME_KEY, client_address
from api.service.accounts import LOCAL_OPERATOR, Role, User
from api.service.problems import Problem, problem_response
from api.service.request_origin import check_host, check_origin
from api.service.settings import ServiceSettings

SAFE_METHODS = frozenset({"GET", "HEAD", "OPTIONS"})
GUARD_THREADS = 8
"""Threads for looking up who asks and writing the audit log."""
READ_OVER_BYTES, READ_OVER_SECONDS = 64 * 1024 * 1024, 5.0
"""How much of a body that is too large is read over, and for how long, before it is answered."""
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
NOBODY = User("nobody", Role.VIEWER, "none")
_log = logging.getLogger(__name__)


class Guard:
    """ASGI middleware; needs the session middleware around it and `app.state.service`."""

    def __init__(self, app: ASGIApp) -> None:
        self.app = app
        self._threads = anyio.CapacityLimiter(GUARD_THREADS)

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        if scope["type"] not in ("http", "websocket"):
            await self.app(scope, receive, send)
            return
        connection = HTTPConnection(scope)
        service = connection.app.state.service
        send = _with_headers(send)
        unbounded = receive
        receive = _bounded(connection, receive, service.settings)
        try:
            _check_address(connection)
            if scope["type"] == "http" and (stopped := connection.app.state.stop_desk.answer(scope)):
                await JSONResponse(stopped.content, stopped.status)(scope, receive, send)
                return
            check_host(connection, service.settings)
            _check_length(connection, service.settings)
            user = await self._who(connection, service)
            scope["user"] = user
            changes = scope["type"] == "http" and scope["method"] not in SAFE_METHODS
            if changes or scope["type"] == "websocket":
                check_origin(connection)
            if changes and user is not None and user.via != "token":
                self._check_csrf(connection)
            if scope["type"] == "websocket" and user is None:
                raise Problem(401, "Sign in, or send a bearer token.", {"WWW-Authenticate": "Bearer"})
        except Problem as problem:
            await _refuse(problem, scope, unbounded, send)
            return
        if scope["type"] == "websocket" and user is not None:
            scope[STILL_WELCOME_KEY] = partial(self._still_welcome, connection, service, user)
        if not changes:
            await self.app(scope, receive, send)
            return
        await self._audited(connection, service, receive, send)

    async def _in_thread(self, function: Callable[..., Any], *arguments: Any) -> Any:
        """Run in a thread that slow requests, which use the default ones, can never have taken: the stop
        button passes here."""
        return await anyio.to_thread.run_sync(function, *arguments, limiter=self._threads)

    def _check_csrf(self, connection: HTTPConnection) -> None:
        expected = connection.session.get(CSRF_KEY)
        # Without our cookie there is nothing that a browser attached by itself; the origin was checked.
        if expected is not None and connection.headers.get(CSRF_HEADER) != expected:
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
        if service.settings.bound_to_loopback and not await self._in_thread(service.accounts.exist):
            service.stop_passes.local_operator = True
            return LOCAL_OPERATOR
        return None

    async def _still_welcome(self, connection: HTTPConnection, service, user: User) -> bool:
        """Whether who opened a connection that stays open could open it now as well."""
        try:
            now = await self._who(connection, service)
        except Problem:
            return False
        return now is not None and now.name == user.name

    async def _audited(self, connection: HTTPConnection, service, receive: Receive, send: Send) -> None:
        scope = connection.scope
        status = 500

        async def watching_send(message: Message) -> None:
            nonlocal status
            if message["type"] == "http.response.start":
                status = message["status"]
            await send(message)

        try:
            await self.app(scope, receive, watching_send)
        finally:
            route = scope.get("route")
            action = f"{scope['method']} {getattr(route, 'path', scope['path'])}"
            # Not even a full disk may keep the stop button from answering.
            try:
                details = scope.get("audit_details")
                append = partial(service.audit.append, client=client_address(connection), details=details)
                await self._in_thread(append, scope.get("user") or NOBODY, action, scope["path"], str(status))
            except Exception:
                _log.exception("the audit log could not be written: %s %s", action, scope["path"])


def _limit(connection: HTTPConnection, settings: ServiceSettings) -> int:
    uploads = connection.headers.get("content-type", "").startswith("multipart/form-data")
    return settings.upload_limit if uploads else settings.body_limit


def _check_address(connection: HTTPConnection) -> None:
    """No name here holds a NUL, and databases and file systems take it each in their own way."""
    if "\x00" in connection.scope["path"] or b"%00" in connection.scope.get("query_string", b""):
        raise Problem(400, "The address holds a NUL character.")


def _check_length(connection: HTTPConnection, settings: ServiceSettings) -> None:
    length, limit = connection.headers.get("content-length", "0"), _limit(connection, settings)
    if length.isdecimal() and int(length) > limit:
        raise Problem(413, f"The body is larger than {limit} bytes.", {"Connection": "close"})


def _bounded(connection: HTTPConnection, receive: Receive, settings: ServiceSettings) -> Receive:
    """Count the body while it comes, whatever its length was said to be."""
    limit = _limit(connection, settings)
    received = 0

    async def receiving() -> Message:
        nonlocal received
        message = await receive()
        if message["type"] == "http.request":
            received += len(message.get("body", b""))
            if received > limit:
                raise HTTPException(413, f"The body is larger than {limit} bytes.")
        return message

    return receiving


def _with_headers(send: Send) -> Send:
    async def sending(message: Message) -> None:
        if message["type"] == "http.response.start":
            headers = MutableHeaders(scope=message)
            for name, value in RESPONSE_HEADERS.items():
                headers.setdefault(name, value)
        await send(message)

    return sending


async def _refuse(problem: Problem, scope: Scope, receive: Receive, send: Send) -> None:
    if scope["type"] == "websocket":
        await send({"type": "websocket.close", "code": POLICY_VIOLATION, "reason": problem.detail[:120]})
        return
    if problem.status == 413:
        await _read_over(receive)
    response = problem_response(problem.status, problem.detail, scope["path"], problem.headers)
    await response(scope, receive, send)


async def _read_over(receive: Receive) -> None:
    """Let a body that is refused arrive, within reason: who still sends when the connection is closed never reads why."""
    read = 0
    with anyio.move_on_after(READ_OVER_SECONDS):
        while read < READ_OVER_BYTES:
            message = await receive()
            read += len(message.get("body", b""))
            if message["type"] != "http.request" or not message.get("more_body", False):
                return
