"""Proofs on the drive by REST: prepared by a job, driven as sessions, in their order; what may do harm is refused in words."""

import re

import pytest

from api.client import Client, ServiceError
from api.proof import read_errors
from api.service.accounts import Role
from daq.rig import RIGS
from daq.session_events import SessionState
from tests.api.driven_arm import short_plan, write_driven_arm

RIG = "rx130l-joint3-simulated"


@pytest.fixture
def arm(service, finished):
    """An operator, and the id of an identified experiment of the rig; there is no plan yet."""
    held = service.service
    rig = held.rigs.rig(RIG)
    with held.experiments.incoming() as folder:
        write_driven_arm(folder, rig)
        experiment = held.experiments.adopt(folder, "arm").id
    client = service.client(Role.OPERATOR)
    job = client.post(f"/experiments/{experiment}/models", json={"model": "load-velocity", "add": []}).json()
    assert finished(client, job)["state"] == "done"
    return client, experiment


def drive(service, client, session):
    """A drive through the steps of every session, to its end."""
    for step in ("check", "weigh", "confirm", "arm", "start"):
        fields = {"mass": 0.0} if step == "weigh" else {}
        client.step("arm", session.id, step, **fields)
    active = service.service.sessions.active(RIG)
    assert active.payload_session.wait(200.0) is SessionState.DONE, active.payload_session.reason
    active.close()


def refuses_what_may_do_harm_or_does_not_go_together(client, http, finished, experiment):
    heavier = finished(http, client.prepare_proof(experiment, RIG, "short", "block"))
    assert heavier["state"] == "failed"
    assert "beyond what the model was identified at" in heavier["words"]
    with pytest.raises(ServiceError, match="does not have the experiment's joints"):
        client.prepare_proof(experiment, "tx40-simulated", "short", "none")
    with pytest.raises(ServiceError, match="m9"):
        client.prepare_proof(experiment, RIG, "short", "none", model="m9")
    wanted = {"rig": RIG, "plan": "short", "payload": "none"}
    for wrong in ({"share": 2.0}, {"share": True}, {"joints": ["j3"]}, {"version": "m1"}, {"plan": None}):
        answer = http.post(f"/experiments/{experiment}/proofs", json=wanted | wrong)
        assert (answer.status_code, next(iter(wrong)) in answer.json()["detail"]) == (422, True), answer.text
    assert client.proofs(experiment) == []


def refuses_a_rig_whose_file_was_changed(service, client, experiment):
    """The torque was computed for cycles and currents of the rig as it was: at another cycle it would not fit the motion."""
    changed = service.service.settings.data_folder / "rigs" / f"{RIG}.yaml"
    changed.parent.mkdir(exist_ok=True)
    changed.write_text((RIGS / f"{RIG}.yaml").read_text().replace("cycle: 0.002", "cycle: 0.004"))
    with pytest.raises(
        ServiceError, match="cycle changed since the proof was prepared; prepare another proof"
    ):
        client.prepare_drive(experiment, "00", "without")
    assert client.proof(experiment, "00").without is None
    changed.unlink()


def takes_the_standard_plan_where_there_is_none(http, experiment):
    address = f"/pages/experiments/{experiment}/proofs"
    assert "Take the standard plan" in http.get(address).text
    assert http.post(f"{address}/plan", data={"rig": "no such rig"}).status_code == 404
    answer = http.post(f"{address}/plan", data={"rig": RIG})
    assert answer.status_code == 204, answer.text
    page = http.get(answer.headers["HX-Redirect"]).text
    assert "Take the standard plan" not in page
    assert f"standard, {RIG}" in page


def test_a_proof_is_prepared_driven_twice_and_listed_with_what_it_did(arm, service, finished):
    http, experiment = arm
    client = Client("", http=http)
    takes_the_standard_plan_where_there_is_none(http, experiment)
    service.service.plans.add(short_plan("short"))
    refuses_what_may_do_harm_or_does_not_go_together(client, http, finished, experiment)
    job = client.prepare_proof(experiment, RIG, "short", "none")
    assert finished(http, job)["result"] == {"model": "m1", "proof": "00"}
    with pytest.raises(ServiceError, match="no feedforward torque was sent yet"):
        client.proof_result(experiment, "00")
    with pytest.raises(ServiceError, match="Run the plan without feedforward torque first"):
        client.prepare_drive(experiment, "00", "with")
    assert client.proof(experiment, "00").next == "without"

    refuses_a_rig_whose_file_was_changed(service, client, experiment)
    first = client.prepare_drive(experiment, "00", "without")
    assert first.id == "proof-00-without"
    assert client.prepare_drive(experiment, "00", "without").id == first.id  # it is gone on with
    drive(service, client, first)
    second = client.prepare_drive(experiment, "00", "with")
    page = http.get(f"/pages/experiments/{experiment}/sessions/{second.id}").text
    assert re.search(r"j3 up to [0-9.]+ A of feedforward, stopped at a following error of", page)
    drive(service, client, second)

    (listed,) = client.proofs(experiment)
    assert (listed.next, listed.model, listed.operator) == (None, "m1", "the-operator")
    assert listed.without.state == listed.with_torque.state == "done"
    found = client.proof_result(experiment, "00")
    assert found.folder == "compensation/00"
    assert found.joints[0].rms_with < found.joints[0].rms_without
    assert "/" not in found.recording_with
    assert str(service.service.experiments.root) not in http.get(f"/experiments/{experiment}/proofs").text
    with pytest.raises(ServiceError, match="prepare another proof"):
        client.prepare_drive(experiment, "00", "with")

    # no model is fitted to it, and it is no session of the experiment, also once the folders were looked at anew
    store = service.service.experiments
    store.reindex()
    assert [row.id for row in store.sessions(experiment)] == ["session-00", "session-01"]
    assert client.session(experiment, "proof-00-with").file == "compensation/00/session-01.h5"
    for step in ("recover", "admit"):
        with pytest.raises(ServiceError, match="no model uses"):
            getattr(client, step)(experiment, "proof-00-with")
    errors = read_errors(store.folder(experiment) / "compensation" / "00")
    assert errors.before.shape == errors.after.shape == errors.position.shape

    viewer = service.client(Role.VIEWER)
    assert "driven by its load" in viewer.get(f"/pages/experiments/{experiment}/proofs/00").text
    for address in ("results", "model", "proofs"):
        page = viewer.get(f"/pages/experiments/{experiment}/{address}").text
        assert "follows better" in page
        assert "Prepare the proof" not in page
    assert viewer.post(f"/experiments/{experiment}/proofs/00/drives/without").status_code == 403

    # A proof whose files were damaged is named, and hides neither the others nor the model's page.
    folder = service.service.experiments.folder(experiment) / "compensation"
    for number, written in (("01", b"{"), ("02", b"\xff\xfe")):
        (folder / number).mkdir()
        (folder / number / "proof.json").write_bytes(written)
    assert [each.proof for each in client.proofs(experiment)] == ["00"]
    page = http.get(f"/pages/experiments/{experiment}/proofs").text
    assert "Proof 01 cannot be read" in page
    assert "Proof 02 cannot be read" in page
    assert str(folder) not in page
    assert http.get(f"/pages/experiments/{experiment}/model").status_code == 200
    with pytest.raises(ServiceError, match=r"proof.json"):
        client.proof(experiment, "01")
