"""Recordings that ended early: which may be closed, which may be used, and what is said of the others."""

import json

import h5py
import numpy as np
import pytest

from api.service.accounts import Role

RIG = "rx130l-joint3-simulated"


@pytest.fixture
def operator(service):
    client = service.client(Role.OPERATOR)
    assert client.post("/experiments", json={"name": "arm", "rig": RIG}).status_code == 201
    return client


@pytest.fixture
def recorded(service, operator):
    """Writes a recording of ten rows with this status, and says what a request about it answers."""

    def write(status, reason, request):
        folder = service.service.experiments.folder("arm")
        (folder / "incomplete").mkdir(exist_ok=True)
        with h5py.File(folder / "incomplete" / "session-00.h5", "w", libver="latest") as file:
            for name in ("cycle", "sync_time"):
                file[name] = np.arange(10) * 2_000_000
            for name in ("position", "command", "setpoint", "valid"):
                file[name] = np.zeros((10, 1), np.int32)
            payload = json.dumps({"name": "none"})
            file.attrs.update({"format": 1, "status": status, "status_reason": reason, "payload": payload})
        service.service.experiments.refresh("arm")
        return operator.post(f"/experiments/arm/sessions/session-00/{request}")

    return write


def test_a_recording_that_was_cut_off_is_closed_by_who_recovers_it_and_not_listed_when_it_is_short(
    recorded, operator
):
    answer = recorded("recording", "", "recover")
    assert answer.status_code == 200, answer.text
    assert answer.json()["state"] == "aborted"
    assert "the recording process died; recovered by the-operator" in answer.json()["reason"]
    assert operator.get("/experiments/arm").json()["payloads"]
    again = operator.post("/experiments/arm/sessions/session-00/recover")
    assert (again.status_code, again.json()["detail"]) == (
        409,
        "The session session-00 is aborted: there is nothing to recover.",
    )


def test_a_person_may_not_decide_about_a_recording_that_is_still_open(recorded):
    answer = recorded("recording", "", "admit")
    assert answer.status_code == 409
    assert (
        answer.json()["detail"] == "The session session-00 is recording: nothing is to be decided about it."
    )


@pytest.mark.parametrize("status", ["aborted", "faulted"])
def test_a_recording_that_lacks_too_much_cannot_be_used_whoever_decides(recorded, operator, status):
    answer = recorded(status, "stopped by the-operator", "admit")
    assert answer.status_code == 409
    assert answer.json()["detail"].startswith("The session session-00 cannot be used: ")
    assert operator.get("/experiments/arm/sessions/session-00").json()["state"] == status
