"""Runs the application: uvicorn for what it serves, the acceptor (`api/acceptor.py`) for who comes in and for stops."""

import contextlib
import errno
import os
import socket
import sys
from functools import partial
from pathlib import Path
from types import FrameType

import uvicorn
from fastapi import FastAPI
from uvicorn.config import STARTUP_FAILURE

from api.acceptor import BACKLOG, Acceptor, Door, Listener
from api.application import create_application
from api.bounded_log import UVICORN_LOG, log_everything_bounded
from api.connections import MOST_CONNECTIONS, Connections, LinkedProtocol
from api.data_folder import STOP_SOCKET
from api.descriptors import raise_limit
from api.quiet_websocket import SAID_AT_ONCE, QuietWebSocket
from api.served_folder import served_alone
from api.service.cookie import cookie_key, signed_content
from api.service.job_process import load_identifier_ahead
from api.service.service import Service
from api.service.settings import ServiceSettings
from identify.recording.errors import InputError

SHUTDOWN = 5
"""s that open connections have to end after an interrupt; the robot is at rest before."""

INTERPRETER_TURN = 0.0005
"""s that a busy thread keeps the interpreter from one that asks for it. The acceptor gives it up in each of its system calls and
has to ask for it again: at Python's 5 ms, a hundred newcomers before a stop held it up for a second while the loop was busy."""


class ServiceServer(uvicorn.Server):
    """uvicorn whose connections come from the acceptor.

    listening : the service's socket (see `listen`), closed at the end
    certificate, key : PEM, for https
    stop : a socket for stops alone; under https, where only its own end can read a connection
    """

    def __init__(
        self,
        application: FastAPI,
        listening: socket.socket,
        *,
        certificate: Path | None = None,
        key: Path | None = None,
        stop: socket.socket | None = None,
    ) -> None:
        trusted = application.state.service.settings.trusted_proxies
        super().__init__(
            uvicorn.Config(
                application,
                log_level="warning",
                log_config=UVICORN_LOG,
                access_log=False,
                http=LinkedProtocol,
                ws=QuietWebSocket,
                ws_max_size=SAID_AT_ONCE,
                # Samples hardly shrink, and compressing them for each viewer costs more than it saves in a lab's network.
                ws_per_message_deflate=False,
                timeout_graceful_shutdown=SHUTDOWN,
                server_header=False,
                # What says where a request comes from is believed of the proxies that were named, and of nobody else.
                proxy_headers=bool(trusted),
                forwarded_allow_ips=list(trusted),
                ssl_certfile=certificate,
                ssl_keyfile=key,
            )
        )
        self._application = application
        self._service: Service = application.state.service
        self._listening = listening
        self._stop = stop
        self._connections: Connections | None = None
        self._acceptor: Acceptor | None = None
        self._local: TerminalSocket | None = None
        self.servers = []

    async def startup(self, sockets: list[socket.socket] | None = None) -> None:
        """Called by uvicorn in the event loop: the application's own start, then its doors."""
        sys.setswitchinterval(INTERPRETER_TURN)
        await self.lifespan.startup()
        if self.lifespan.should_exit:
            sys.exit(STARTUP_FAILURE)
        soft = raise_limit()
        self._connections = Connections(self.config, self.server_state, min(MOST_CONNECTIONS, soft // 2))
        self._connections.start(self.lifespan.state)
        listeners = [Listener(self._listening, Door.SERVICE, self.config.ssl)]
        if self._stop is not None:
            listeners.append(Listener(self._stop, Door.STOP, self.config.ssl))
        data = self._service.settings.data_folder
        self._local = TerminalSocket.open(data)
        if self._local is not None:
            listeners.append(Listener(self._local.socket, Door.LOCAL))
        self._acceptor = Acceptor(
            listeners,
            self._application.state.stop_requests,
            partial(signed_content, key=cookie_key(data)),
            self._connections,
            self._service.loop_pulse,
        )
        self._service.stop_readiness.depend_on("acceptor", self._acceptor.pulse)
        self._acceptor.start()
        self.started = True

    async def shutdown(self, sockets: list[socket.socket] | None = None) -> None:
        """Called by uvicorn at the end; stops are answered until whatever moves was told to stop."""
        self._service.rig_stop.stop_all("the service was asked to end")
        if self._acceptor is not None and self._connections is not None:
            self._service.stop_readiness.no_longer("acceptor")
            self._acceptor.close()
            self._connections.end()
        if self._local is not None:
            self._local.remove()
        await super().shutdown(sockets)

    def handle_exit(self, sig: int, frame: FrameType | None) -> None:
        """Called by uvicorn on SIGINT and SIGTERM: the robot stops at the signal itself, before connections are given time."""
        self._service.rig_stop.stop_all("the service was asked to end")
        super().handle_exit(sig, frame)


def run_service(
    settings: ServiceSettings,
    certificate: Path | None = None,
    key: Path | None = None,
    stop_port: int | None = None,
) -> None:
    """Serve until interrupted.

    stop_port : of the stop's own door; None takes the port after the service's, or a free one, and only under https

    Raises InputError if another service has the data folder, if the address cannot be listened on, or see `create_application`.
    """
    log_everything_bounded()
    with served_alone(settings.data_folder) as say_where:
        application = create_application(settings)
        listening = listen(settings.host, settings.port)
        stop = _listen_for_stops(listening, settings.host, stop_port, https=certificate is not None)
        load_identifier_ahead()
        server = ServiceServer(application, listening, certificate=certificate, key=key, stop=stop)
        scheme = "https" if certificate else "http"
        host = f"[{settings.host}]" if ":" in settings.host else settings.host
        port = listening.getsockname()[1]
        address = f"{scheme}://{host}:{port}/"
        say_where(address)
        print(f"coulomb: serving {address} (stop with Ctrl-C)", file=sys.stderr, flush=True)
        if stop is not None:
            application.state.stop_port = stop.getsockname()[1]
            print(
                f"coulomb: the stop button's own port is {application.state.stop_port}; let it through where a firewall is",
                file=sys.stderr,
                flush=True,
            )
        if not settings.bound_to_loopback and not settings.secure_cookies:
            print(
                "coulomb: passwords and cookies travel in clear; use --tls-certificate and --tls-key",
                file=sys.stderr,
                flush=True,
            )
        server.run()


def _listen_for_stops(
    listening: socket.socket, host: str, wanted: int | None, *, https: bool
) -> socket.socket | None:
    if wanted is not None:
        return listen(host, wanted, option="--stop-port")
    if not https:
        return None  # a connection in clear is looked into at the service's own port
    try:
        return listen(host, listening.getsockname()[1] + 1)
    except (InputError, OverflowError):
        return listen(host, 0)


def listen(host: str, port: int, option: str = "--port") -> socket.socket:
    """A socket on that address; port 0 takes a free one. Raises InputError if it cannot be had."""
    try:
        family = socket.getaddrinfo(host, port, type=socket.SOCK_STREAM)[0][0]
        # asyncio sends small answers at once only where the protocol is named; else they wait 40 ms for an
        # ACK.
        listening = socket.socket(family, socket.SOCK_STREAM, socket.IPPROTO_TCP)
        listening.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
        listening.bind((host, port))
        listening.listen(BACKLOG)  # from here on nobody who comes early is turned away
    except OSError as error:
        if error.errno == errno.EADDRINUSE:
            raise InputError(
                f"{option} {port}: something else listens there; choose another, or 0 for a free one"
            ) from error
        raise InputError(f"--host {host} {option} {port}: cannot listen there ({error.strerror})") from error
    return listening


class TerminalSocket:
    """The socket of `coulomb stop`, in the data folder; the service's own user alone can open it."""

    def __init__(self, path: Path, listening: socket.socket) -> None:
        self._path = path
        self.socket = listening
        self._made = path.stat()

    @classmethod
    def open(cls, data_folder: Path) -> "TerminalSocket | None":
        """None where the folder's name is too long for one, or its file system has no sockets; the rest works without.

        A name that is there was left by a service that was killed: one service at a time has the folder (`api/served_folder.py`).
        """
        path = data_folder / STOP_SOCKET
        listening = socket.socket(socket.AF_UNIX, socket.SOCK_STREAM)
        before = os.umask(0o177)
        try:
            path.unlink(missing_ok=True)
            listening.bind(os.fspath(path))
            listening.listen(BACKLOG)
            return cls(path, listening)
        except OSError as error:
            listening.close()
            print(f"coulomb: `coulomb stop` will not work: {path}: {error}", file=sys.stderr, flush=True)
            return None
        finally:
            os.umask(before)

    def remove(self) -> None:
        """Take its name away, unless it is another service's by now."""
        with contextlib.suppress(OSError):
            status = self._path.stat()
            if (status.st_dev, status.st_ino) == (self._made.st_dev, self._made.st_ino):
                self._path.unlink()
