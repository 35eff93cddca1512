"""Run as a process of its own: the service as `coulomb serve` runs it, with few descriptors and a way to freeze its loop.

python -m tests.attack.serve DATA PORT DESCRIPTORS [CERTIFICATE KEY STOP_PORT]
"""

import ctypes
import resource
import sys
import time
from pathlib import Path

from api.application import create_application
from api.server import ServiceServer, listen
from api.service import access
from api.service.settings import ServiceSettings


def main() -> None:
    """Serve until interrupted."""
    data, port, descriptors = Path(sys.argv[1]), int(sys.argv[2]), int(sys.argv[3])
    resource.setrlimit(resource.RLIMIT_NOFILE, (descriptors, descriptors))
    certificate, key = (Path(part) for part in sys.argv[4:6]) if len(sys.argv) > 4 else (None, None)
    application = create_application(
        ServiceSettings(data_folder=data, port=port, secure_cookies=key is not None)
    )

    @application.post("/freeze/{seconds}", dependencies=[access.Public])
    async def freeze(seconds: float) -> None:  # pyright: ignore[reportUnusedFunction]
        """What a handler does that forgets where it runs."""
        time.sleep(seconds)

    @application.post("/hold/{seconds}", dependencies=[access.Public])
    async def hold(seconds: int) -> None:  # pyright: ignore[reportUnusedFunction]
        """A call into C that keeps the interpreter's lock: no thread of this process runs."""
        ctypes.PyDLL(None).sleep(seconds)

    stop = None
    if certificate is not None:
        application.state.stop_port = int(sys.argv[6])
        stop = listen("127.0.0.1", application.state.stop_port)
    ServiceServer(application, listen("127.0.0.1", port), certificate=certificate, key=key, stop=stop).run()


if __name__ == "__main__":
    main()
