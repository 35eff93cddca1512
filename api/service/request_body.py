"""How much of a request's body is listened to."""

from typing import TypedDict

import anyio
from starlette.exceptions import HTTPException
from starlette.requests import HTTPConnection
from starlette.types import Message, Receive

from api.service.problems import Problem
from api.service.route_table import DeclaredRoute
from api.service.settings import ServiceSettings

LARGEST_OF_STRANGERS = 16 * 1024
"""Bytes of a body that is sent without a sign-in: a name and a password."""
READ_OVER_BYTES, READ_OVER_SECONDS = 64 * 1024 * 1024, 5.0
"""How much of a body that is refused is read over, and for how long, before it is answered."""


class FormLimits(TypedDict, total=False):
    """Of a form in parts, as FastAPI takes them; what is left out is inherited."""

    max_files: int
    max_fields: int
    max_part_size: int
    """bytes of a field that is no file"""


FORM: FormLimits = {"max_files": 1, "max_fields": 50, "max_part_size": 64 * 1024}
"""Of a form in parts: each file of more than a megabyte would have a descriptor and a place on the disk."""
MOST_RECORDS = 10
"""Files of records in one request."""
FORM_OF_RECORDS: FormLimits = {"max_files": MOST_RECORDS + 1, "max_fields": 500}
"""Where one session comes in several files, with the robot's, and what is said of each joint."""


def body_limit(route: DeclaredRoute | None, settings: ServiceSettings) -> int:
    """Bytes that a request to this route may have."""
    if route is None or route.role is None:
        return LARGEST_OF_STRANGERS
    return settings.upload_limit if route.takes_file else settings.body_limit


def check_length(connection: HTTPConnection, limit: int) -> None:
    """Raises the problem 413 where the body is said to be larger."""
    length = connection.headers.get("content-length", "0")
    if length.isdecimal() and int(length) > limit:
        raise Problem(413, f"The body is larger than {limit} bytes.", {"Connection": "close"})


def bounded(receive: Receive, limit: int) -> Receive:
    """Count the body while it comes, whatever its length was said to be."""
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


async def read_over(receive: Receive) -> None:
    """Let a body that is refused arrive, within reason: who still sends when the connection is closed never reads why."""
    read = 0
    with anyio.move_on_after(READ_OVER_SECONDS):
        while read < READ_OVER_BYTES:
            message = await receive()
            read += len(message.get("body", b""))
            if message["type"] != "http.request" or not message.get("more_body", False):
                return
