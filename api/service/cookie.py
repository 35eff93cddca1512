"""The sign-in's cookie: what it is called, the key that signs it, and how it is read where no middleware does."""

import json
import os
import secrets
from base64 import b64decode
from pathlib import Path
from typing import Any

from itsdangerous import BadSignature, TimestampSigner

COOKIE = "coulomb"


def cookie_key(data_folder: Path) -> str:
    """The key that signs cookies: made once, readable by the service's own user alone."""
    file = data_folder / "cookie.key"
    try:
        descriptor = os.open(file, os.O_WRONLY | os.O_CREAT | os.O_EXCL, 0o600)
    except FileExistsError:
        return file.read_text()
    key = secrets.token_hex(32)
    with os.fdopen(descriptor, "w") as stream:
        stream.write(key)
    return key


def signed_content(header: str, key: str) -> dict[str, Any]:
    """What the cookie in a Cookie header holds, however old it is; empty where there is none that we signed.

    Written by Starlette's SessionMiddleware: base64 of JSON, signed by itsdangerous' TimestampSigner.
    """
    # Ours is never quoted; `http.cookies` takes quadratic time for what may stand in others.
    values = dict(pair.strip().split("=", 1) for pair in header.split(";") if "=" in pair)
    try:
        content = json.loads(b64decode(TimestampSigner(key).unsign(values.get(COOKIE, ""))))
    except (BadSignature, ValueError):
        return {}
    return content if isinstance(content, dict) else {}
