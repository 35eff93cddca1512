"""An application on uvicorn with the product's own settings, in a thread of the tests' process."""

import threading
from collections.abc import Iterator
from contextlib import contextmanager

from fastapi import FastAPI

from api.server import ServiceServer, listen


@contextmanager
def served(application: FastAPI, port: int = 0) -> Iterator[str]:
    """Serve on a port of this machine, or a free one; gives the address."""
    listener = listen("127.0.0.1", port)
    address = f"http://127.0.0.1:{listener.getsockname()[1]}"
    server = ServiceServer(application, listener)
    started = threading.Event()
    begin = server.startup

    async def startup(sockets: list | None = None) -> None:
        await begin(sockets)
        started.set()

    server.startup = startup  # type: ignore[method-assign]
    thread = threading.Thread(target=server.run, daemon=True)
    thread.start()
    assert started.wait(30.0), "the service did not start"
    try:
        yield address
    finally:
        server.should_exit = True
        thread.join(30.0)
        assert not thread.is_alive()
