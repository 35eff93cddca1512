"""From a diagnosis that left rivals to the plan of the experiment that tells them apart, by REST and on the page."""

from pathlib import Path

import pytest
import yaml

from api.service.accounts import Role
from daq.rig import RIGS


def write_rig_of_one_joint(data_folder: Path) -> None:
    """The simulated joint under the name that the pendulum's joint has."""
    rig = yaml.safe_load((RIGS / "rx130l-joint3-simulated.yaml").read_text())
    rig["name"] = "pendulum-rig"
    rig["axes"][0]["joint"] = "j1"
    rig["robot"]["joints"][0]["name"] = "j1"
    (data_folder / "rigs").mkdir(parents=True, exist_ok=True)
    (data_folder / "rigs" / "pendulum-rig.yaml").write_text(yaml.safe_dump(rig))


@pytest.fixture
def in_doubt(service, tmp_path, write_measured_experiment, zipped, finished):
    """An operator's client, and an experiment of one session without payload, diagnosed: its load is its own weight."""
    client = service.client(Role.OPERATOR)
    archive = zipped(write_measured_experiment(tmp_path / "measured", sessions=1))
    answer = client.post("/experiments/import", files={"file": ("pendulum.zip", archive)}).json()
    assert finished(client, answer["job"])["state"] == "done"
    experiment = answer["experiment"]["id"]
    job = client.post(f"/experiments/{experiment}/models/m1/diagnosis").json()
    assert finished(client, job)["state"] == "done"
    return client, experiment


def test_rivals_lead_to_an_experiment_and_that_to_a_plan_that_a_session_takes(
    in_doubt, data_folder, finished
):
    client, experiment = in_doubt
    address = f"/experiments/{experiment}/models/m1/next-experiment"
    assert client.get(address, params={"joint": "j1"}).status_code == 404
    assert client.post(f"{address}/plan", json={"joint": "j1"}).status_code == 409

    answer = client.post(address, json={"joint": "j1"})
    assert answer.status_code == 202
    assert finished(client, answer.json())["state"] == "done"
    found = client.get(address, params={"joint": "j1"}).json()
    diagnosis = client.get(f"/experiments/{experiment}/models/m1/diagnosis").json()
    candidates = {each["effect"]: each for each in diagnosis["joints"][0]["candidates"]}
    assert found["rivals"][1] in candidates[found["rivals"][0]]["indistinguishable_from"]
    best = found["proposals"][0]
    assert best["payload"] == "disk"  # only a change of the load tells

    refused = client.post(f"{address}/plan", json={"joint": "j1"})
    assert refused.status_code == 409
    assert "No rig here has the joints j1" in refused.json()["detail"]
    write_rig_of_one_joint(data_folder)
    made = client.post(f"{address}/plan", json={"joint": "j1"})
    assert made.status_code == 201, made.text
    assert made.json()["rig"] == "pendulum-rig"
    assert made.json()["payload"] == best["payload"]
    plan = client.get(made.headers["Location"]).json()
    assert plan["joints"] == ["j1"]
    assert plan["report"]["purpose"]["rivals"] == found["rivals"]
    session = {
        "rig": "pendulum-rig",
        "plan": plan["id"],
        "payload": {"name": best["payload"], "mass": 3.0, "com": [0.5, 0, 0]},
    }
    assert client.post(f"/experiments/{experiment}/sessions", json=session).status_code == 201
    assert client.post(f"{address}/plan", json={"joint": "j1", "proposal": 20}).status_code == 404
    assert client.post(f"{address}/plan", json={"joint": "j7"}).status_code == 404


def test_the_page_offers_the_experiment_and_carries_its_plan_to_a_new_session(
    in_doubt, data_folder, finished
):
    client, experiment = in_doubt
    write_rig_of_one_joint(data_folder)
    client.headers["Accept"] = "text/html"
    page = f"/pages/experiments/{experiment}/missing"
    assert "Find the experiment that tells them apart" in client.get(page).text
    begun = client.post(f"{page}/apart?joint=j1")
    assert begun.status_code == 200
    jobs = client.get("/jobs", headers={"Accept": "application/json"}).json()
    job = next(each for each in jobs if each["kind"] == "separate")
    assert finished(client, job)["state"] == "done"
    text = client.get(f"{page}/apart?joint=j1").text
    assert "The experiment that would help most to tell load-friction from load-friction-asymmetric" in text
    assert "unless one is a special case of the other" in text
    assert "Plan this experiment" in text
    carried = client.post(f"{page}/apart/plan?joint=j1&proposal=1")
    assert carried.status_code == 204
    link = carried.headers["HX-Redirect"]
    assert link.startswith("/pages/new-session?rig=pendulum-rig")
    form = client.get(link).text
    assert "Made to tell" in form
    assert '<option value="disk" selected>' in form


def test_what_a_candidate_would_leave_is_drawn_before_it_is_added(in_doubt):
    client, experiment = in_doubt
    text = client.get(f"/pages/experiments/{experiment}/missing", headers={"Accept": "text/html"}).text
    assert "predicted with it" in text
    assert 'class="band"' in text
    assert (
        "Caution." in text
    )  # without a change of load it cannot be known whether the friction follows the load


def test_a_diagnosis_does_not_outlive_the_fit_that_it_was_made_of(in_doubt, finished):
    client, experiment = in_doubt
    job = client.post(f"/experiments/{experiment}/models/refit").json()
    assert finished(client, job)["state"] == "done"
    assert client.get(f"/experiments/{experiment}/models/m1/diagnosis").status_code == 404


def test_the_session_of_such_a_plan_says_what_it_is_for(in_doubt, data_folder, finished):
    client, experiment = in_doubt
    write_rig_of_one_joint(data_folder)
    address = f"/experiments/{experiment}/models/m1/next-experiment"
    assert finished(client, client.post(address, json={"joint": "j1"}).json())["state"] == "done"
    made = client.post(f"{address}/plan", json={"joint": "j1"}).json()
    session = {"rig": made["rig"], "plan": made["plan"], "payload": {"name": "none"}}
    prepared = client.post(f"/experiments/{experiment}/sessions", json=session)
    assert prepared.status_code == 201, prepared.text
    page = client.get(
        f"/pages/experiments/{experiment}/sessions/{prepared.json()['id']}", headers={"Accept": "text/html"}
    )
    assert page.status_code == 200
    assert "Made to tell" in page.text
