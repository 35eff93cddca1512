"""An answer in JSON as bytes, where no framework writes it: to requests that never come to the application."""

import json
from collections.abc import Mapping
from http import HTTPStatus
from typing import Any

from api.service.problems import PROBLEM_MEDIA_TYPE


def written_answer(status: int, content: Mapping[str, Any], *fields: str) -> bytes:
    """Head and body; the last answer of its connection.

    fields : further header fields, a line each
    """
    body = json.dumps(content).encode()
    lines = [
        f"HTTP/1.1 {status} {HTTPStatus(status).phrase}",
        f"Content-Type: {'application/json' if status < 400 else PROBLEM_MEDIA_TYPE}",
        f"Content-Length: {len(body)}",
        "Connection: close",
        "X-Content-Type-Options: nosniff",
        "Cache-Control: no-store",
        *fields,
    ]
    return "\r\n".join([*lines, "", ""]).encode("latin-1") + body
