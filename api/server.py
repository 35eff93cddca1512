"""Runs the application on uvicorn."""

import errno
import socket
import sys
from pathlib import Path
from types import FrameType

import uvicorn
from fastapi import FastAPI

from api.application import create_application
from api.service.job_process import load_identifier_ahead
from api.service.service import Service
from api.service.settings import ServiceSettings
from identify.recording.errors import InputError

LARGEST_MESSAGE = 64 * 1024
"""Bytes of a WebSocket message from a browser; ours has nothing to say there."""
SHUTDOWN = 5
"""s that open connections have to end after an interrupt; the robot is at rest before."""


def server_settings(
    application: FastAPI, certificate: Path | None = None, key: Path | None = None
) -> uvicorn.Config:
    """How the application is run; certificate and key (PEM) for https."""
    return uvicorn.Config(
        application,
        log_level="warning",
        access_log=False,
        ws_max_size=LARGEST_MESSAGE,
        # Samples hardly shrink, and compressing them for each viewer costs more than it saves in a lab's
        # network.
        ws_per_message_deflate=False,
        timeout_graceful_shutdown=SHUTDOWN,
        server_header=False,
        ssl_certfile=certificate,
        ssl_keyfile=key,
    )


class _Server(uvicorn.Server):
    """Stops the robot at the signal itself, before open connections are given their time to end."""

    def handle_exit(self, sig: int, frame: FrameType | None) -> None:
        """Called by uvicorn on SIGINT and SIGTERM."""
        service: Service = self.config.app.state.service  # type: ignore[union-attr]
        service.rig_stop.stop_all("the service was asked to end")
        super().handle_exit(sig, frame)


def run_service(settings: ServiceSettings, certificate: Path | None = None, key: Path | None = None) -> None:
    """Serve until interrupted.

    Raises InputError if the address cannot be listened on, or see `create_application`.
    """
    application = create_application(settings)
    listening = listen(settings.host, settings.port)
    load_identifier_ahead()
    server = _Server(server_settings(application, certificate, key))
    scheme = "https" if certificate else "http"
    host = f"[{settings.host}]" if ":" in settings.host else settings.host
    port = listening.getsockname()[1]
    print(f"coulomb: serving {scheme}://{host}:{port}/ (stop with Ctrl-C)", file=sys.stderr, flush=True)
    if not settings.bound_to_loopback and not settings.secure_cookies:
        print(
            "coulomb: passwords and cookies travel in clear; use --tls-certificate and --tls-key",
            file=sys.stderr,
            flush=True,
        )
    server.run(sockets=[listening])


def listen(host: str, port: int) -> socket.socket:
    """A socket on that address; port 0 takes a free one. Raises InputError if it cannot be had."""
    try:
        family = socket.getaddrinfo(host, port, type=socket.SOCK_STREAM)[0][0]
        # asyncio sends small answers at once only where the protocol is named; else they wait 40 ms for an
        # ACK.
        listening = socket.socket(family, socket.SOCK_STREAM, socket.IPPROTO_TCP)
        listening.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
        listening.bind((host, port))
        listening.listen()  # from here on nobody who comes early is turned away
    except OSError as error:
        if error.errno == errno.EADDRINUSE:
            raise InputError(
                f"--port {port}: something else listens there; choose another, or 0 for a free one"
            ) from error
        raise InputError(f"--host {host} --port {port}: cannot listen there ({error.strerror})") from error
    return listening
