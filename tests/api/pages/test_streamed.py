"""A long page is sent while it is written."""

import zlib
from collections.abc import Iterator

import anyio
import pytest
from fastapi import Request

from api.pages.streamed import CHUNK, streamed


@pytest.mark.parametrize("accepted", [b"gzip, br", b"identity"])
def test_the_beginning_can_be_read_before_the_rest_is_written(accepted: bytes) -> None:
    written: list[int] = []

    def pieces() -> Iterator[str]:
        for number in range(40):
            written.append(number)
            yield f"<p>é {number}</p>" * (CHUNK // 64)

    request = Request({"type": "http", "headers": [(b"accept-encoding", accepted)]})
    response = streamed(request, pieces(), {"Cache-Control": "no-store"})
    compressed = response.headers.get("content-encoding") == "gzip"
    assert compressed == (b"gzip" in accepted)
    reader = zlib.decompressobj(wbits=31)
    seen: list[tuple[str, int]] = []

    async def read() -> None:
        async for chunk in response.body_iterator:
            assert isinstance(chunk, bytes)
            seen.append(((reader.decompress(chunk) if compressed else chunk).decode(), len(written)))

    anyio.run(read)
    text, then = seen[0]
    assert len(text) >= CHUNK
    assert then < len(written)
    assert "".join(text for text, _ in seen) == "".join(pieces())
    assert reader.eof == compressed
