"""A long page, sent while it is written: a browser shows its beginning meanwhile."""

import zlib
from collections.abc import Iterable, Iterator, Mapping

from fastapi import Request
from fastapi.responses import StreamingResponse

CHUNK = 1 << 15
"""letters that are sent together"""
GZIP = 31
"""window of zlib for which the stream is one of gzip"""


def streamed(request: Request, pieces: Iterable[str], headers: Mapping[str, str]) -> StreamingResponse:
    """An HTML page of many pieces, compressed where the browser takes that.

    For pages that hold no secret: what travels compressed beside an address of somebody else's making can be guessed by its
    length.
    """
    chunks = (piece.encode() for piece in _gathered(pieces))
    sent = {**headers, "Vary": "Accept-Encoding"}
    if "gzip" in request.headers.get("accept-encoding", ""):
        chunks, sent = _compressed(chunks), sent | {"Content-Encoding": "gzip"}
    return StreamingResponse(chunks, media_type="text/html", headers=sent)


def _gathered(pieces: Iterable[str]) -> Iterator[str]:
    waiting: list[str] = []
    size = 0
    for piece in pieces:
        waiting.append(piece)
        size += len(piece)
        if size >= CHUNK:
            yield "".join(waiting)
            waiting, size = [], 0
    yield "".join(waiting)


def _compressed(chunks: Iterable[bytes]) -> Iterator[bytes]:
    """Each chunk can be read as soon as it has come."""
    compressor = zlib.compressobj(5, wbits=GZIP)
    for chunk in chunks:
        yield compressor.compress(chunk) + compressor.flush(zlib.Z_SYNC_FLUSH)
    yield compressor.flush()
