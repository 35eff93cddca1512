"""The head of a request, judged by its bytes before anybody parses it, and brought to the form that everything else knows.

Parsing thousands of header fields, cookies or parameters takes longer than all the rest of a request; some hundred
connections that send such heads would hold the event loop, and with it the sign of life to the acquisition, without an account.
"""

import re
from dataclasses import dataclass
from urllib.parse import unquote_to_bytes

import h11
from starlette.types import ASGIApp, Receive, Scope, Send

LONGEST_HEAD = 32 * 1024
"""bytes of request line and fields"""
LONGEST_TARGET = 8 * 1024
"""bytes of the request line (RFC 9112, 3, asks for 8000)"""
MOST_FIELDS = 100
MOST_COOKIES = 200
"""a browser keeps some 180 for one host, all ports of it together"""
_END = re.compile(rb"\n\r?\n")
"""an empty line, also without CR (RFC 9112, 2.2), as h11 takes it"""
_FIELD = re.compile(rb"\n([^\s:]+)[ \t]*:")
_ABSOLUTE = re.compile(rb"https?://([^/?]*)(/[^?]*)?", re.IGNORECASE)


@dataclass(frozen=True)
class Objection:
    """Why a head is not taken: HTTP status and one sentence."""

    status: int
    detail: str


def head_of(read: bytes | bytearray) -> bytes | None:
    """The head that these bytes begin with; None as long as its end has not come."""
    end = _END.search(read)
    return None if end is None else bytes(read[: end.end()])


def objection_to(head: bytes) -> Objection | None:
    """Why this head, or the part of one that has come, is not taken; None where it may be parsed."""
    if len(head) > LONGEST_HEAD:
        return Objection(431, f"The head of the request is longer than {LONGEST_HEAD} bytes.")
    if head.find(b"\n") > LONGEST_TARGET or (len(head) > LONGEST_TARGET and b"\n" not in head):
        return Objection(414, f"The address is longer than {LONGEST_TARGET} bytes.")
    if head.count(b"\n") > MOST_FIELDS + 2:
        return Objection(431, f"The request has more than {MOST_FIELDS} header fields.")
    if head.count(b";") > MOST_COOKIES:
        return Objection(431, f"The request has more than {MOST_COOKIES} cookies or parts of a field.")
    names = {name.lower() for name in _FIELD.findall(head)}
    if {b"content-length", b"transfer-encoding"} <= names:
        # Two ways to say where the body ends: a proxy might take the other, and the rest for a request (RFC 9112, 6.1).
        return Objection(400, "The request has both Content-Length and Transfer-Encoding.")
    return None


def request_of(head: bytes) -> h11.Request | None:
    """The request that these bytes begin with; None where they are none, or one that is not taken."""
    whole = head_of(head)
    if whole is None or objection_to(whole) is not None:
        return None
    parser = h11.Connection(h11.SERVER, max_incomplete_event_size=LONGEST_HEAD)
    try:
        parser.receive_data(whole)
        event = parser.next_event()
    except h11.RemoteProtocolError:
        return None
    return event if isinstance(event, h11.Request) else None


def in_origin_form(scope: Scope) -> Scope:
    """The scope of a request; one in absolute form (`GET http://host/path`, RFC 9112, 3.2.2) as if it had been `GET /path` with
    that host, whatever its Host field says."""
    match = _ABSOLUTE.fullmatch(scope.get("raw_path") or b"")
    if match is None:
        return scope
    authority, path = match[1], match[2] or b"/"
    fields = [(name, value) for name, value in scope["headers"] if name != b"host"]
    return {
        **scope,
        "raw_path": path,
        "path": unquote_to_bytes(path).decode("utf-8", "replace"),
        "headers": [(b"host", authority), *fields],
    }


class OriginForm:
    """ASGI middleware: requests in absolute form are those of the other form."""

    def __init__(self, app: ASGIApp) -> None:
        self.app = app

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        await self.app(in_origin_form(scope), receive, send)
