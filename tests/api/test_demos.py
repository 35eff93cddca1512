"""The demo as a job: an experiment with a model from one call, and nothing of it where it is broken off."""

import os
import select
import signal
from multiprocessing import forkserver
from pathlib import Path

import pytest

from api.service.accounts import Role
from tests.api.short_demo import short_plan

HTML = {"Accept": "text/html"}
PATIENCE = 60_000  # ms


def children(process: int) -> list[int]:
    """The processes that a process has started and that have not ended."""
    started = []
    for status in Path("/proc").glob("[0-9]*/stat"):
        try:
            state, parent = status.read_text().rpartition(")")[2].split()[:2]
        except OSError:
            continue  # ended meanwhile
        if int(parent) == process and state != "Z":
            started.append(int(status.parent.name))
    return started


def rings_of(process: int) -> set[Path]:
    """The shared memory that a process has mapped."""
    mapped = [line.split()[-1] for line in Path(f"/proc/{process}/maps").read_text().splitlines()]
    return {Path(name) for name in mapped if name.startswith("/dev/shm/coulomb-ring-")}


def wait_for_end(process: int) -> None:
    """Wait until a process that is not our child has ended."""
    try:
        descriptor = os.pidfd_open(process)
    except ProcessLookupError:
        return
    ended = select.poll()
    ended.register(descriptor, select.POLLIN)
    assert ended.poll(PATIENCE), Path(f"/proc/{process}/cmdline").read_text()
    os.close(descriptor)


def until_it_moves(client, job: dict) -> None:
    with client.websocket_connect(f"ws://localhost:8000/jobs/{job['id']}/live") as connection:
        while "moving" not in (said := connection.receive_json())["words"]:
            assert said["state"] in ("queued", "running"), said


def test_one_call_gives_an_experiment_with_three_sessions_and_a_model(service, finished, tmp_path: Path):
    operator = service.client(Role.OPERATOR)
    held = service.service.demos.plan = tmp_path / "plan.json"
    os.mkfifo(held)  # the job waits until somebody writes its plan
    begun = operator.post("/experiments/demo")
    assert begun.status_code == 202, begun.text
    again = operator.post("/pages/demo", headers=HTML)
    followed = f"/pages/demo/progress?job={begun.json()['id']}"
    assert followed in again.text  # one of a person at a time
    assert followed in operator.get("/pages/experiments", headers=HTML).text
    held.write_text(short_plan())
    job = finished(operator, begun.json())
    assert (job["state"], job["result"]) == ("done", {"experiment": "demo", "model": "m1"}), job
    experiment = operator.get("/experiments/demo").json()
    assert experiment["name"] == "demo"
    assert [each["weighed"] for each in experiment["sessions"]] == [0.0, 3.4584, 6.97]
    assert {each["operator"] for each in experiment["sessions"]} == {"the-operator"}
    results = operator.get("/experiments/demo/results").json()
    assert not results["stale"]
    assert 0.001 < results["relative_error"] < 0.05
    page = operator.get("/pages/demo/progress", params={"job": job["id"]}, headers=HTML)
    assert page.headers["HX-Redirect"] == "/pages/experiments/demo/results"
    assert [each.name for each in service.service.experiments.root.iterdir()] == ["demo"]


@pytest.mark.parametrize("ending", ["cancelled", "killed"])
def test_a_demo_that_is_broken_off_leaves_nothing_behind(service, finished, tmp_path: Path, ending: str):
    operator = service.client(Role.OPERATOR)
    service.service.demos.plan = tmp_path / "plan.json"
    service.service.demos.plan.write_text(short_plan(rest=900.0))  # it does not end by itself meanwhile
    before = set(children(forkserver._forkserver._forkserver_pid))
    job = operator.post("/experiments/demo").json()
    until_it_moves(operator, job)
    assert operator.get("/experiments").json() == []
    (computing,) = set(children(forkserver._forkserver._forkserver_pid)) - before
    started = children(computing)
    assert len(started) == 2  # acquisition and recorder
    rings = set().union(*map(rings_of, started))
    assert rings
    followed = {"params": {"job": job["id"]}, "headers": HTML}
    if ending == "cancelled":
        button = f"/pages/jobs/{job['id']}/cancel"
        assert button in operator.get("/pages/demo/progress", **followed).text
        assert operator.post(button, headers=HTML).status_code == 204
    else:
        os.kill(computing, signal.SIGKILL)
    said = finished(operator, job)
    assert said["state"] == ("cancelled" if ending == "cancelled" else "failed"), said
    if ending == "cancelled":
        assert "Nothing was measured: cancelled." in operator.get("/pages/demo/progress", **followed).text
    for process in started:
        wait_for_end(process)
    assert [ring for ring in rings if ring.exists()] == []
    assert list(service.service.experiments.root.iterdir()) == []
