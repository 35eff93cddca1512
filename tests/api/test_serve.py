"""`coulomb serve`, `users` and `reindex` as real processes."""

import json
import os
import signal
import sqlite3
import subprocess
import sys
import threading
import time

import httpx
import pytest
from websockets.sync.client import connect

from api.client import Client
from daq.recovery import recording_state

RIG = "rx130l-joint3-simulated"

PASSWORD = "correct horse battery\n"


def coulomb(*arguments, data, **options):
    return subprocess.run(
        [sys.executable, "-m", "api", *arguments],
        env=os.environ | {"COULOMB_DATA": str(data)},
        capture_output=True,
        text=True,
        timeout=60,
        check=False,
        **options,
    )


def test_the_service_answers_and_ends_when_told_to(serve):
    process, address = serve()
    assert httpx.get(f"{address}/me", timeout=30).json()["role"] == "operator"
    assert "Server" not in httpx.get(f"{address}/me", timeout=30).headers
    process.send_signal(signal.SIGTERM)
    assert process.wait(30) in (0, -signal.SIGTERM)


def test_a_killed_service_starts_again_and_knows_what_was_stored(serve):
    process, address = serve()
    new = {"name": "arm", "rig": "rx130l-joint3-simulated"}
    assert httpx.post(f"{address}/experiments", json=new, timeout=30).status_code == 201
    process.kill()
    process.wait()
    _process, address = serve()
    assert [each["id"] for each in httpx.get(f"{address}/experiments", timeout=30).json()] == ["arm"]


def test_users_and_tokens_made_on_the_command_line_are_those_of_the_running_service(serve, data_folder):
    _process, address = serve()
    made = coulomb("users", "add", "ada", "--role", "operator", data=data_folder, input=PASSWORD)
    assert made.returncode == 0, made.stderr
    assert httpx.get(f"{address}/me", timeout=30).status_code == 401
    token = coulomb("users", "token", "ada", "--scope", "operator", data=data_folder).stdout.strip()
    who = httpx.get(f"{address}/me", headers={"Authorization": f"Bearer {token}"}, timeout=30).json()
    assert (who["name"], who["role"], who["via"]) == ("ada", "operator", "token")
    assert json.loads(coulomb("users", "list", "--json", data=data_folder).stdout) == [
        {"name": "ada", "role": "operator"}
    ]


@pytest.mark.parametrize(
    ("arguments", "given", "words"),
    [
        (["serve", "--host", "0.0.0.0"], None, "users add"),
        (["serve", "--host", "999.1.1.1"], None, "users add"),
        (["serve", "--tls-key", "KEY"], None, "--tls-certificate"),
        (["serve", "--database", "mysql://localhost/x"], None, "mysql is not supported"),
        (["serve", "--database", "nonsense"], None, "database address"),
        (["users", "add", "Ada"], PASSWORD, "lower-case"),
        (["users", "add", "ada"], "short\n", "10 to 1000 characters"),
        (["users", "add", "ada", "--role", "chief"], PASSWORD, "viewer, operator, admin"),
        (["users", "change", "ada"], None, "--role ROLE, --password"),
        (["users", "remove", "ada"], None, "there is no user ada"),
        (["users", "token", "ada"], None, "there is no user ada"),
    ],
)
def test_wrong_arguments_are_answered_with_one_line_and_status_2(
    coulomb_here, tmp_path, arguments, given, words
):
    (tmp_path / "key.pem").touch()
    arguments = [each.replace("KEY", str(tmp_path / "key.pem")) for each in arguments]
    found = coulomb_here(*arguments, given=given)
    assert found.returncode == 2
    assert words in found.stderr
    assert len(found.stderr.strip().splitlines()) == 1
    assert found.stdout == ""


def test_a_port_that_is_taken_is_named(serve, tmp_path):
    _process, address = serve()
    port = address.rpartition(":")[2]
    found = coulomb("serve", "--port", port, data=tmp_path / "another")
    assert found.returncode == 2
    assert f"--port {port}: something else listens there" in found.stderr


def test_a_second_service_on_a_folder_is_turned_away_and_the_first_keeps_its_jobs_and_its_stop(
    serve, data_folder
):
    """It took the first one's stop, so that `coulomb stop` said that nothing moves, and called its jobs lost."""
    process, address = serve()
    job = httpx.post(f"{address}/experiments/demo", timeout=30).json()["id"]
    for port in (address.rpartition(":")[2], "0"):
        second = coulomb("serve", "--port", port, data=data_folder)
        assert second.returncode == 2
        assert f"another service (process {process.pid}, {address}/) serves it" in second.stderr
        assert len(second.stderr.strip().splitlines()) == 1
    with sqlite3.connect(data_folder / "service.sqlite") as database:
        (state,) = database.execute("SELECT state FROM jobs WHERE id = ?", (job,)).fetchone()
    assert state != "lost"
    assert httpx.post(f"{address}/jobs/{job}/cancel", timeout=30).status_code == 202
    stopped = coulomb("stop", data=data_folder)
    assert stopped.returncode == 0, stopped.stderr


def test_a_data_folder_that_cannot_be_made_is_named(coulomb_here, tmp_path):
    (tmp_path / "file").touch()
    found = coulomb_here("reindex", "--data", str(tmp_path / "file" / "data"))
    assert found.returncode == 2
    assert "data folder" in found.stderr


def test_reindex_says_how_many_there_are_and_which_are_broken(
    coulomb_here, data_folder, write_measured_experiment
):
    write_measured_experiment(data_folder / "experiments" / "good")
    bad = write_measured_experiment(data_folder / "experiments" / "bad") / "experiment.yaml"
    bad.write_text(bad.read_text().replace("format: 1", "format: 7"))
    found = json.loads(coulomb_here("reindex", "--json").stdout)
    assert found["experiments"] == 2
    assert list(found["problems"]) == ["bad"]
    assert "format" in found["problems"]["bad"]


def test_the_last_admin_cannot_be_removed_and_every_change_is_logged(coulomb_here, data_folder):
    coulomb_here("users", "add", "ada", "--role", "admin", given=PASSWORD)
    found = coulomb_here("users", "remove", "ada")
    assert found.returncode == 2
    assert "last admin" in found.stderr
    coulomb_here("users", "add", "root", "--role", "admin", given=PASSWORD)
    assert coulomb_here("users", "change", "ada", "--role", "viewer").returncode == 0
    from api.service.open_data import open_data

    with open_data(data_folder, None) as opened:
        actions = [(row.action, row.target) for row in reversed(opened.audit.rows())]
    assert actions == [("users add", "ada"), ("users add", "root"), ("users change", "ada")]


@pytest.mark.parametrize(
    ("ending", "reason"),
    [(signal.SIGKILL, "the supervising process"), (signal.SIGTERM, "the service was asked to end")],
)
def test_a_service_that_ends_during_motion_loses_no_sample_and_finds_the_session_again(
    serve, data_folder, ending, reason
):
    process, address = serve()
    with Client(address, timeout=60) as client:
        plan = client.wait(client.make_plan(RIG, "short", seconds=20, model="usual")).result.plan
        client.create_experiment("arm", RIG)
        session = client.create_session("arm", RIG, plan, "none").id
        client.step("arm", session, "weigh", mass=0.0)
        for step in ("check", "confirm", "arm"):
            client.step("arm", session, step)
        with connect(address.replace("http", "ws") + f"/rigs/{RIG}/live") as live:
            client.step("arm", session, "start")
            fraction = 0.0
            while fraction < 0.2:  # well into the plan, so that there is something to lose
                message = live.recv(timeout=30)
                if isinstance(message, str):
                    fraction = json.loads(message)["session"]["fraction"]
            process.send_signal(ending)
            process.wait(60)

    def states():
        folder = data_folder / "experiments" / "arm"
        return [recording_state(path) for path in (*folder.glob("*.h5"), *folder.glob("incomplete/*.h5"))]

    deadline = time.monotonic() + 60.0
    while time.monotonic() < deadline and (not states() or states()[0].status == "recording"):
        threading.Event().wait(0.1)  # acquisition and recorder end by themselves, without us
    (found,) = states()
    assert found.status in ("aborted", "faulted")
    assert reason in found.reason
    assert found.rows > 0

    _process, address = serve()
    with Client(address, timeout=60) as client:
        again = client.session("arm", session)
        assert again.state == found.status
        assert again.reason == found.reason
        assert client.recordings("arm")[0].session == session
