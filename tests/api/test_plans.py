"""Plans: made in a job, stored, previewed."""

import numpy as np
import pytest

from api.service.accounts import Role
from daq.excitation.excitation_plan import ExcitationPlan
from daq.rig import Rig

RIG = "rx130l-joint3-simulated"


@pytest.fixture
def planned(service, finished):
    client = service.client(Role.OPERATOR)
    job = client.post(
        "/plans", json={"rig": RIG, "name": "Joint 3, slow", "seconds": 20, "model": "usual"}
    ).json()
    state = finished(client, job)
    assert state["state"] == "done", state
    assert state["result"] == {"plan": "joint-3-slow"}
    return client, "joint-3-slow"


def test_a_plan_keeps_the_limits_of_its_rig_and_says_what_it_will_tell(planned, data_folder):
    client, plan = planned
    found = client.get(f"/plans/{plan}").json()
    report = found["report"]
    assert {"ZZ1R", "FV1"} <= {parameter["name"] for parameter in report["parameters"]}
    assert all("reason" in hidden for hidden in report["cannot_tell"])
    limits = Rig.load(RIG).axes[0].limits
    preview = client.get(f"/plans/{plan}/preview", params={"points": 500}).json()
    assert preview["violations"] == []
    assert np.abs(preview["velocity"]).max() <= limits.velocity * (1 + 1e-6)
    assert (
        limits.position[0] <= np.min(preview["position"]) <= np.max(preview["position"]) <= limits.position[1]
    )
    stored = ExcitationPlan.load(data_folder / "plans" / f"{plan}.json")
    expected = stored.setpoints(np.array(preview["time"])).position[:, 0]
    np.testing.assert_allclose(preview["position"][0], expected, atol=1e-12)


def test_the_predicted_current_of_every_payload_comes_with_the_plan(planned):
    client, plan = planned
    predicted = client.get(f"/plans/{plan}").json()["report"]["predicted"]
    by_payload = {each["payload"]: np.array(each["current"]) for each in predicted["currents"]}
    assert set(by_payload) == {"none", "disk-3.5", "disk-7"}
    assert len(predicted["time"]) == len(by_payload["none"])
    # More mass needs more current.
    assert (
        np.abs(by_payload["none"]).max()
        < np.abs(by_payload["disk-3.5"]).max()
        < np.abs(by_payload["disk-7"]).max()
    )


def test_two_plans_of_one_name_have_two_ids(planned, finished):
    client, _plan = planned
    body = {"rig": RIG, "name": "Joint 3, slow", "seconds": 20, "model": "usual"}
    job = finished(client, client.post("/plans", json=body).json())
    assert job["result"] == {"plan": "joint-3-slow-2"}
    assert {plan["id"] for plan in client.get("/plans").json()} == {"joint-3-slow", "joint-3-slow-2"}


def test_a_plan_that_cannot_be_made_says_why(service, finished):
    client = service.client(Role.OPERATOR)
    job = client.post("/plans", json={"rig": RIG, "name": "hasty", "seconds": 1.5, "model": "usual"}).json()
    state = finished(client, job)
    assert state["state"] == "failed"
    assert "s" in state["words"]
    assert client.get("/plans").json() == []


@pytest.mark.parametrize(
    ("change", "status", "words"),
    [
        ({"rig": "nowhere"}, 422, "known are rx130l"),
        ({"experiment": "nowhere"}, 404, "No experiment"),
        ({"seconds": -1}, 422, "seconds"),
        ({"name": "a/b\n"}, 422, "name"),
    ],
)
def test_a_wrong_request_is_refused_before_anything_is_computed(service, change, status, words):
    client = service.client(Role.OPERATOR)
    answer = client.post("/plans", json={"rig": RIG, "name": "plan"} | change)
    assert answer.status_code == status
    assert words in answer.json()["detail"]
    assert client.get("/jobs").json() == []
