"""Static files: under an address with their common digest, so that a browser may keep them for good, and held in memory.

A page waits for a dozen of them. The application asks this router first: to look for their address behind all others takes
longer than to answer.
"""

import gzip
import hashlib
import mimetypes
from dataclasses import dataclass
from functools import cache
from pathlib import Path

from fastapi import APIRouter, Request
from fastapi.responses import Response

from api.service import access
from api.service.problems import Problem

router = APIRouter(include_in_schema=False)

FOLDER = Path(__file__).parent / "static"
ADDRESS = "/pages/static"
COMPRESSIBLE = (".js", ".css", ".svg")
"""Endings of static files that travel compressed; typefaces are already."""
HEADERS = {"Cache-Control": "public, max-age=31536000, immutable", "Vary": "Accept-Encoding"}


@dataclass(frozen=True)
class StaticFile:
    """What a browser may ask for; `compressed` is the same as gzip, a third of the size, or None."""

    kind: str | None
    content: bytes
    compressed: bytes | None


@cache
def static_files() -> dict[str, StaticFile]:
    """Every file by its name under the static address; nothing else is reachable."""
    files = {}
    for file in sorted(FOLDER.rglob("*")):
        if file.is_file():
            content = file.read_bytes()
            compressed = gzip.compress(content, 9, mtime=0) if file.suffix in COMPRESSIBLE else None
            kind = mimetypes.guess_type(file.name)[0]
            files[file.relative_to(FOLDER).as_posix()] = StaticFile(kind, content, compressed)
    return files


@cache
def static_digest() -> str:
    """Digest of every static file, 12 hexadecimal digits."""
    digest = hashlib.sha256()
    for name, file in static_files().items():
        digest.update(name.encode())
        digest.update(file.content)
    return digest.hexdigest()[:12]


def static_address(name: str) -> str:
    """Address of a static file; it changes when any of them does."""
    return f"{ADDRESS}/{static_digest()}/{name}"


@router.get(f"{ADDRESS}/{{digest}}/{{name:path}}", dependencies=[access.Public])
async def static_file(request: Request, digest: str, name: str) -> Response:
    """A static file of ours by its name, whatever the digest says: it only tells browsers of a change."""
    file = static_files().get(name)
    if file is None:
        raise Problem(404, f"There is no file {name}.")
    if file.compressed is not None and "gzip" in request.headers.get("accept-encoding", ""):
        return Response(file.compressed, media_type=file.kind, headers=HEADERS | {"Content-Encoding": "gzip"})
    return Response(file.content, media_type=file.kind, headers=HEADERS)
