"""The service on PostgreSQL: a real server, started for these tests where its programs are installed."""

import os
import shutil
import subprocess
import tempfile
from collections.abc import Iterator
from pathlib import Path

import pytest
from sqlalchemy import text
from sqlalchemy.exc import DBAPIError

from api.service.accounts import Role
from api.service.database import Database
from identify.recording.errors import InputError

RIG = "rx130l-joint3-simulated"
INSTALLED = sorted(Path("/usr/lib/postgresql").glob("*/bin"), reverse=True)


def program(name: str) -> str | None:
    """The path of one of PostgreSQL's programs; Debian keeps those of the server out of PATH."""
    return shutil.which(name, path=os.pathsep.join([os.environ.get("PATH", ""), *map(str, INSTALLED)]))


@pytest.fixture(scope="module")
def server() -> Iterator[str]:
    """Folder of the socket of a fresh server, which refuses to run as root: it then runs as its package's user."""
    if program("initdb") is None or program("pg_ctl") is None:
        pytest.skip("no PostgreSQL server here (Debian package postgresql)")
    pytest.importorskip("psycopg", reason="the driver is not installed: coulomb[postgresql]")
    someone = "postgres" if os.geteuid() == 0 else None
    folder = Path(
        tempfile.mkdtemp(prefix="coulomb-postgresql-")
    )  # a short path: a socket's may have 107 letters
    if someone:
        shutil.chown(folder, someone)

    def run(name: str, *arguments: str) -> None:
        done = subprocess.run(
            [str(program(name)), "-D", str(folder / "data"), *arguments],
            user=someone,
            cwd=folder,
            stdout=subprocess.DEVNULL,
            stderr=subprocess.PIPE,
            text=True,
            timeout=120,
        )
        assert done.returncode == 0, done.stderr

    try:
        run("initdb", "-U", "postgres", "-A", "trust", "-E", "UTF8", "--no-sync")
        options = f"-k {folder} -c listen_addresses= -c fsync=off"
        run("pg_ctl", "-w", "-l", str(folder / "log"), "-o", options, "start")
        yield str(folder)
        run("pg_ctl", "-w", "-m", "immediate", "stop")
    finally:
        shutil.rmtree(folder, ignore_errors=True)


@pytest.fixture
def address(server: str, request: pytest.FixtureRequest) -> str:
    """The address of a database of one's own."""
    import psycopg

    name = f"test_{abs(hash(request.node.nodeid)):x}"
    with psycopg.connect(f"host={server} user=postgres dbname=postgres", autocommit=True) as connection:
        connection.execute(f"CREATE DATABASE {name}")  # type: ignore[arg-type]
    return f"postgresql:///{name}?host={server}&user=postgres"


def test_the_story_of_an_experiment_is_the_same_on_postgresql(
    start_service, address, tmp_path, write_measured_experiment, zipped, finished
):
    service = start_service(database_url=address)
    service.client(Role.ADMIN)
    client = service.client(Role.OPERATOR)
    archive = zipped(write_measured_experiment(tmp_path / "measured"))
    answer = client.post("/experiments/import", files={"file": ("pendulum.zip", archive)})
    assert answer.status_code == 201, answer.text
    assert finished(client, answer.json()["job"])["state"] == "done"
    job = client.post("/experiments/pendulum/models/effects", json={"effect": "load-friction", "joint": "j1"})
    assert finished(client, job.json())["state"] == "done"
    assert client.post("/experiments/pendulum/models/undo").status_code == 200
    assert {row["state"] for row in client.get("/jobs").json()} == {"done"}
    log = service.client(Role.ADMIN, "root").get("/audit").json()
    assert "POST /experiments/{experiment}/models/undo" in [row["action"] for row in log]


def test_postgresql_refuses_to_change_the_audit_log_too(start_service, address):
    service = start_service(database_url=address)
    service.client(Role.OPERATOR).post(f"/rigs/{RIG}/take")
    for statement in ("UPDATE audit_log SET role = 'x'", "DELETE FROM audit_log", "TRUNCATE audit_log"):
        with (
            pytest.raises(DBAPIError, match="append-only"),
            service.service.database.transaction() as session,
        ):
            session.execute(text(statement))


def test_a_lost_index_is_rebuilt_and_accounts_stay(start_service, address, write_measured_experiment):
    service = start_service(database_url=address)
    long = "a" * 240  # longer than most columns; a file's name may have 255 letters
    folder = write_measured_experiment(service.service.experiments.root / "pendulum", name=long)
    (folder / "session-00.csv").rename(folder / f"{long}.csv")
    declared = (folder / "experiment.yaml").read_text()
    (folder / "experiment.yaml").write_text(declared.replace("session-00.csv", f"{long}.csv"))
    service.client(Role.VIEWER)
    with service.service.database.transaction() as session:
        session.execute(text("DELETE FROM sessions"))
        session.execute(text("DELETE FROM experiments"))
    assert service.service.experiments.reindex() == 1
    sessions = service.client(Role.VIEWER).get("/experiments/pendulum/sessions").json()
    assert [row["id"] for row in sessions] == [long, "session-01"]


def test_a_service_finds_what_another_one_stored(start_service, address):
    first = start_service(database_url=address)
    first.service.accounts.add_user("ada", "correct horse battery", Role.ADMIN)
    again = Database(address)  # tables and triggers stand already
    again.close()
    second = start_service(database_url=address)
    assert [row.name for row in second.service.accounts.users()] == ["ada"]


def test_a_database_that_is_not_there_is_named_in_one_line(server):
    with pytest.raises(InputError, match="nowhere") as refused:
        Database(f"postgresql:///nowhere?host={server}&user=postgres")
    assert "\n" not in str(refused.value)
