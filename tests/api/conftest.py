"""A service on a data folder of its own, and clients of every role."""

import io
import re
import subprocess
import sys
import warnings
import zipfile
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pytest
import typer
from fastapi import FastAPI

from api import command_line
from api.application import create_application
from api.service.accounts import Role
from api.service.job_documents import JobView
from api.service.service import Service
from api.service.settings import ServiceSettings
from daq.rig import Rig
from tests.api.served import served

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
    lifetime: TestClient | None = None
    """The client whose context is the application's lifespan; its event loop serves all others too."""

    def client(self, role: Role | None = None, name: str | None = None) -> TestClient:
        """A client with a bearer token of a user of that role; None is somebody who did not sign in."""
        client = TestClient(self.application, base_url=ADDRESS, raise_server_exceptions=False)
        client.portal = self.lifetime.portal if self.lifetime else None
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


@pytest.fixture(scope="module")
def rig() -> Rig:
    """The simulated arm of the paper; modules about another rig have one of their own."""
    return Rig.load("rx130l-joint3-simulated")


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
        return RunningService(application, application.state.service, clock, client)

    yield start
    for client in reversed(entered):
        client.__exit__(None, None, None)


@pytest.fixture
def service(start_service: Callable[..., RunningService]) -> RunningService:
    """A service without accounts on this machine."""
    return start_service()


@pytest.fixture
def serve(data_folder: Path) -> Iterator[Callable[..., tuple[subprocess.Popen[str], str]]]:
    """Starts `coulomb serve` on a free port; returns the process and its address."""
    started: list[subprocess.Popen[str]] = []

    def start(*arguments: str) -> tuple[subprocess.Popen[str], str]:
        process = subprocess.Popen(
            [sys.executable, "-m", "api", "serve", "--port", "0", "--data", str(data_folder), *arguments],
            stderr=subprocess.PIPE,
            text=True,
        )
        started.append(process)
        assert process.stderr is not None
        line = process.stderr.readline()
        found = re.search(r"serving (\S+)/ ", line)
        assert found, line
        return process, found[1]

    yield start
    for process in started:
        if process.poll() is None:
            process.kill()
        process.wait()
        assert process.stderr is not None
        process.stderr.close()


@dataclass(frozen=True)
class Answered:
    """What a command left: as `subprocess.run` says it."""

    returncode: int
    stdout: str
    stderr: str


@pytest.fixture
def coulomb_here(
    data_folder: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> Callable[..., Answered]:
    """The command line within this process, which spares the seconds that a new one takes to begin."""

    def run(*arguments: str, given: str | None = None) -> Answered:
        application = typer.Typer(no_args_is_help=True, add_completion=False, pretty_exceptions_enable=False)
        application.callback()(command_line.coulomb)
        monkeypatch.setattr(command_line, "application", application)
        monkeypatch.setenv("COULOMB_DATA", str(data_folder))
        monkeypatch.setattr(sys, "argv", ["coulomb", *arguments])
        monkeypatch.setattr(sys, "stdin", io.StringIO(given or ""))
        capsys.readouterr()
        try:
            command_line.main()
            status = 0
        except SystemExit as ended:
            status = ended.code if isinstance(ended.code, int) else 0
        said = capsys.readouterr()
        return Answered(status, said.out, said.err)

    return run


@dataclass
class ListeningService(RunningService):
    """A service that really listens, on a port of its own."""

    address: str = ""


@pytest.fixture
def listening(data_folder: Path, clock: Clock) -> Iterator[ListeningService]:
    """A service on uvicorn, in a thread of the tests' process."""
    application = create_application(ServiceSettings(data_folder=data_folder, clock=clock))
    with served(application) as address:
        yield ListeningService(application, application.state.service, clock, address=address)


def _write_measured_experiment(
    folder: Path, name: str = "pendulum", sessions: int = 2, seconds: float = 20.0
) -> Path:
    """An experiment of one joint with known truth: torque of a pendulum with friction that grows with the
    load.

    J = 2 kg m², MX = 3 kg m, F_v = 4 N m s/rad, F_c = 5 N m, offset 0.5 N m; drive gain 10 N m/A. Sessions
    carry nothing, then a disk of 3 kg at 0.5 m; `seconds` at 500 Hz each.
    """
    random = np.random.default_rng(1)
    time = np.arange(0.0, seconds, 0.002)
    folder.mkdir(parents=True)
    entries = []
    for number in range(sessions):
        mass = 3.0 * (number % 2)
        phase = 0.3 * number
        w = 2 * np.pi * np.array([0.1, 0.25, 0.6])
        a = np.array([0.8, 0.3, 0.1])
        angle = np.outer(time, w) + phase
        q, dq, ddq = np.sin(angle) @ a, np.cos(angle) @ (a * w), -np.sin(angle) @ (a * w**2)
        inertia, moment = 2.0 + mass * 0.25, 3.0 + mass * 0.5
        load = inertia * ddq + 9.81 * moment * np.cos(q)
        friction = 4.0 * dq + (5.0 + 0.1 * np.abs(load)) * np.sign(dq) + 0.5
        command = (load + friction) / 10.0 + random.normal(0.0, 0.02, len(time))
        rows = np.column_stack([time, q, command])
        file = f"session-{number:02d}.csv"
        np.savetxt(folder / file, rows, delimiter=",", header="t,q1,v1", comments="", fmt="%.9g")
        entries.append(f"  - {{file: {file}, payload: {'disk' if mass else 'none'}}}")
    (folder / "experiment.yaml").write_text(
        "\n".join(
            [
                "format: 1",
                f"name: {name}",
                "robot:",
                "  gravity: [0.0, -9.81, 0.0]",
                "  joints: [{name: j1, type: revolute, drive_gain: 10.0}]",
                "payloads:",
                "  - {name: none, mass: 0.0}",
                "  - {name: disk, mass: 3.0, com: [0.5, 0.0, 0.0]}",
                "sessions:",
                *entries,
                "",
            ]
        )
    )
    return folder


def _zipped(folder: Path) -> bytes:
    """A folder's files as a zip archive."""
    packed = io.BytesIO()
    with zipfile.ZipFile(packed, "w", zipfile.ZIP_DEFLATED) as archive:
        for file in sorted(folder.iterdir()):
            archive.write(file, file.name)
    return packed.getvalue()


def _finished(client: TestClient, job: dict | JobView) -> dict:
    """The last state of a job, as REST or the client gave it, waited for on its WebSocket."""
    state = job.model_dump(mode="json") if isinstance(job, JobView) else job
    with client.websocket_connect(f"ws://localhost:8000/jobs/{state['id']}/live") as connection:
        while state["state"] in ("queued", "running"):
            state = connection.receive_json()
    return state


@pytest.fixture(name="finished")
def finished_fixture() -> Callable[[TestClient, dict], dict]:
    return _finished


@pytest.fixture(name="write_measured_experiment")
def write_measured_experiment_fixture() -> Callable[..., Path]:
    return _write_measured_experiment


@pytest.fixture(name="zipped")
def zipped_fixture() -> Callable[[Path], bytes]:
    return _zipped


@pytest.fixture
def imported(service: RunningService, tmp_path: Path) -> tuple[TestClient, str]:
    """An operator's client, and the id of an experiment of two sessions that is identified."""
    return _imported(service, _write_measured_experiment(tmp_path / "measured"))


@pytest.fixture
def imported_short(service: RunningService, tmp_path: Path) -> tuple[TestClient, str]:
    """The same with sessions of 6 s, for what takes long to compute."""
    return _imported(service, _write_measured_experiment(tmp_path / "measured", seconds=6.0))


def _imported(service: RunningService, measured: Path) -> tuple[TestClient, str]:
    client = service.client(Role.OPERATOR)
    archive = _zipped(measured)
    answer = client.post("/experiments/import", files={"file": ("pendulum.zip", archive)})
    assert answer.status_code == 201, answer.text
    assert _finished(client, answer.json()["job"])["state"] == "done"
    return client, answer.json()["experiment"]["id"]
