"""Simulations and exports of models, by REST, with the real identifier in real processes."""

import io
import re
import zipfile

import pytest

from api.client import Client, ServiceError
from api.service.accounts import Role
from api.service.model_use import ENDINGS
from identify.export.write import KINDS
from identify.recording.controller_file import ControllerFile


def computed(client, address, finished):
    answer = client.post(address)
    assert answer.status_code == 202, answer.text
    assert answer.headers["Location"] == f"/jobs/{answer.json()['id']}"
    job = finished(client, answer.json())
    assert job["state"] == "done", job
    return job


def test_a_model_is_simulated_and_its_errors_are_kept_with_its_fit(imported_short, finished):
    client, experiment = imported_short
    address = f"/experiments/{experiment}/models/m1/simulation"
    before = client.get(address)
    assert before.status_code == 404
    assert "not simulated yet" in before.json()["detail"]
    for wrong in ("0", "-1", "inf", "nan", "x"):
        answer = client.post(f"{address}?horizon={wrong}")
        assert answer.status_code == 422
        assert "query.horizon" in answer.json()["detail"]
    assert computed(client, f"{address}?horizon=1&horizon=0.3", finished)["kind"] == "simulate"
    found = Client("", http=client).simulation(experiment, "m1")
    assert [row.horizon for row in found.horizons] == [0.3, 1.0, None]
    assert found.unseen is not None
    assert found.model == "usual"
    free = next(row for row in found.horizons if row.horizon is None)
    session, by_rest = free.sessions[0], Client("", http=client)
    run = by_rest.free_run(experiment, "m1", session.file, session.joints[0].joint)
    assert run.time == sorted(run.time)
    error = [value for value in run.position.error if value is not None]
    # left out of the reduced curves: nothing of the error's extremes, so that its mean square cannot be beyond them
    assert max(map(abs, error)) >= session.joints[0].position_rms
    assert set(run.position.usual) == {None}
    name = session.joints[0].joint
    # in closed loop with given gains: refused by what is wrong with them, and where the record has no reference
    gains = {"joints": [{"joint": name, "position": 1.0, "velocity": 0.5}]}
    wrong = client.post(address, json={"joints": [{"joint": name, "position": "stiff", "velocity": 0.5}]})
    assert wrong.status_code == 422
    twice = client.post(f"{address}?driven_by=estimate", json=gains)
    assert twice.status_code == 422
    assert "driven_by is estimate and the body holds gains" in twice.json()["detail"]
    job = by_rest.simulate(experiment, "m1", gains=ControllerFile.model_validate(gains))
    assert "no column 'qref1' with the reference" in finished(client, job)["words"]
    for file, joint, said in (
        ("none.csv", name, "not simulated on"),
        (session.file, "none", "no joint none"),
    ):
        with pytest.raises(ServiceError, match=said):
            by_rest.free_run(experiment, "m1", file, joint)


@pytest.mark.parametrize("ending", ["c", "st", "json"])
def test_a_model_is_exported_with_its_certificate(imported, finished, ending):
    client, experiment = imported
    address = f"/experiments/{experiment}/models/m1/exports/{ending}"
    for early in (address, f"{address}/file"):
        answer = client.get(early)
        assert answer.status_code == 404
        assert "not exported" in answer.json()["detail"]
    job = computed(client, address, finished)
    by_rest = Client("", http=client)
    certificate = by_rest.certificate(experiment, "m1", ending)
    assert certificate.target == job["result"]["file"] == f"{experiment}-m1.{ending}"
    assert certificate.joints[0].lost == ()
    content = by_rest.exported_file(experiment, "m1", ending)
    if ending == "c":
        names = zipfile.ZipFile(io.BytesIO(content)).namelist()
        stem = f"{experiment}-m1"
        assert names == [f"{stem}.c", f"{stem}.h", f"{stem}.c.certificate.json"]
    else:
        assert certificate.experiment in content.decode()


def test_a_target_that_there_is_not_a_model_that_there_is_not_and_a_viewer_are_refused(imported, service):
    client, experiment = imported
    assert client.post(f"/experiments/{experiment}/models/m1/exports/stl").status_code == 422
    assert client.post(f"/experiments/{experiment}/models/m9/exports/py").status_code == 404
    assert client.post(f"/experiments/{experiment}/models/m9/simulation").status_code == 404
    viewer = service.client(Role.VIEWER)
    assert viewer.post(f"/experiments/{experiment}/models/m1/simulation").status_code == 403


def test_why_an_export_failed_stays_on_the_page_until_it_is_tried_again(
    imported_short, finished, data_folder
):
    client, experiment = imported_short
    page, address = (
        f"/pages/experiments/{experiment}/results",
        f"/experiments/{experiment}/models/m1/exports/json",
    )
    (fit,) = data_folder.rglob("identification.json")
    in_the_way = fit.parent / "exports" / f"{experiment}-m1.json"
    in_the_way.mkdir(parents=True)
    assert finished(client, client.post(address).json())["state"] == "failed"
    for _ in range(2):
        assert re.search(r'data-export-fault="json">.*is a folder, but a file', client.get(page).text)
    in_the_way.rmdir()
    computed(client, address, finished)
    assert "data-export-fault" not in client.get(page).text


def test_every_format_of_the_identifier_can_be_asked_for():
    assert {f".{ending}" for ending in ENDINGS} == set(KINDS)
