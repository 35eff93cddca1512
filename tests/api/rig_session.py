"""Steps of payload sessions through the service, on the simulated rig, for the tests of several modules."""

import json

import pytest

from api.service.accounts import Role
from api.service.live import decode_block

RIG = "rx130l-joint3-simulated"
STEPS = ("check", "confirm", "arm", "start")


@pytest.fixture
def operator(service, finished):
    """An operator with a plan and an empty experiment `arm`."""
    client = service.client(Role.OPERATOR)
    job = client.post("/plans", json={"rig": RIG, "name": "short", "seconds": 20, "model": "usual"}).json()
    assert finished(client, job)["state"] == "done"
    assert client.post("/experiments", json={"name": "arm", "rig": RIG}).status_code == 201
    return client


def prepare(client, payload="none"):
    new = {"rig": RIG, "plan": "short", "payload": {"name": payload}}
    return client.post("/experiments/arm/sessions", json=new)


def take(client, session, *steps, mass=None):
    """Take steps of a session; returns the last answer, after the first that was refused."""
    answers = []
    for step in steps:
        body = {"json": {"mass": mass}} if step == "weigh" else {}
        answers.append(client.post(f"/experiments/arm/sessions/{session}/{step}", **body))
        if answers[-1].status_code != 200:
            break
    return answers[-1]


def watch(client, until=()):
    """Look at the rig live until the session's state is one of `until`; returns blocks and the last
    status.
    """
    blocks = []
    with client.websocket_connect(f"ws://localhost:8000/rigs/{RIG}/live") as connection:
        while True:
            message = connection.receive()
            if message.get("bytes"):
                blocks.append(decode_block(message["bytes"]))
                continue
            status = json.loads(message["text"])
            if status["session"] and status["session"]["state"] in (*until, "done", "aborted", "faulted"):
                return blocks, status
