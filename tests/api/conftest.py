"""A service on a data folder of its own, and clients of every role."""

import threading
import warnings
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field
from pathlib import Path

import httpx
import pytest
import uvicorn
from fastapi import FastAPI

from api.service.accounts import Role
from api.service.application import Service, create_application
from api.service.server import listen, server_settings
from api.service.settings import ServiceSettings

with warnings.catch_warnings():
    # Starlette's test client says that another HTTP library will follow; ours is the one in the lock.
    warnings.simplefilter("ignore")
    from fastapi.testclient import TestClient

ADDRESS = "http://localhost:8000"
PASSWORD = "correct horse battery"
RIG = "rx130l-joint3-simulated"


@dataclass
class Clock:
    """Seconds since 1970 that pass only when told to."""

    now: float = 1_800_000_000.0

    def __call__(self) -> float:
        return self.now

    def advance(self, seconds: float) -> None:
        self.now += seconds


@dataclass
class RunningService:
    """An application with its clients."""

    application: FastAPI
    service: Service
    clock: Clock
    _open: list[TestClient] = field(default_factory=list)

    def client(self, role: Role | None = None, name: str | None = None) -> TestClient:
        """A client with a bearer token of a user of that role; None is somebody who did not sign in."""
        client = TestClient(self.application, base_url=ADDRESS, raise_server_exceptions=False)
        if role is not None:
            name = name or f"the-{role}"
            if not any(row.name == name for row in self.service.accounts.users()):
                self.service.accounts.add_user(name, PASSWORD, role)
            token = self.service.accounts.issue_token(name, "test", role, 86400.0)
            client.headers["Authorization"] = f"Bearer {token.secret}"
        return client

    def browser(self, name: str, password: str = PASSWORD) -> TestClient:
        """A client that signs in as a browser does: cookie, and the CSRF token in every request."""
        client = self.client()
        answer = client.post("/sign-in", json={"name": name, "password": password})
        assert answer.status_code == 200, answer.text
        client.headers["X-CSRF-Token"] = answer.json()["csrf_token"]
        return client


@pytest.fixture
def clock() -> Clock:
    return Clock()


@pytest.fixture
def data_folder(tmp_path: Path) -> Path:
    return tmp_path / "data"


@pytest.fixture
def start_service(data_folder: Path, clock: Clock) -> Iterator[Callable[..., RunningService]]:
    """Starts services on the data folder; they are ended with the test."""
    entered: list[TestClient] = []

    def start(**settings) -> RunningService:
        application = create_application(ServiceSettings(data_folder=data_folder, clock=clock, **settings))
        client = TestClient(application, base_url=ADDRESS)
        client.__enter__()
        entered.append(client)
        return RunningService(application, application.state.service, clock)

    yield start
    for client in reversed(entered):
        client.__exit__(None, None, None)


@pytest.fixture
def service(start_service: Callable[..., RunningService]) -> RunningService:
    """A service without accounts on this machine."""
    return start_service()


@dataclass
class ListeningService(RunningService):
    """A service that really listens, on a port of its own."""

    address: str = ""


@pytest.fixture
def listening(data_folder: Path, clock: Clock) -> Iterator[ListeningService]:
    """A service on uvicorn, in a thread of the tests' process."""
    application = create_application(ServiceSettings(data_folder=data_folder, clock=clock))
    server = uvicorn.Server(server_settings(application))
    socket = listen("127.0.0.1", 0)
    thread = threading.Thread(target=server.run, kwargs={"sockets": [socket]})
    address = f"http://127.0.0.1:{socket.getsockname()[1]}"
    thread.start()
    running = ListeningService(application, application.state.service, clock, address=address)
    # Answers only once it has started.
    httpx.get(f"{address}/me", timeout=30.0)
    yield running
    server.should_exit = True
    thread.join(30.0)
    socket.close()
    assert not thread.is_alive()
