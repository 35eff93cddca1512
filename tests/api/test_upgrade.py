"""A data folder of an earlier version is opened: its people, log, sessions and stored models are there, and work goes on.

The folders in `earlier/` were written by the code of those versions: version 1 by commit 4f793a3, version 2 by commit 8941088.
"""

import shutil
import sqlite3
from pathlib import Path

import pytest

from api.service.accounts import Role
from api.service.backup import restore_backup, write_backup
from api.service.open_data import open_data

EARLIER = Path(__file__).parent / "earlier"


@pytest.fixture(params=["version-1", "version-2"])
def upgraded(request, data_folder, start_service, write_measured_experiment):
    """This version's service on an earlier version's folder, and an admin's client."""
    folder = EARLIER / request.param
    experiments = data_folder / "experiments"
    write_measured_experiment(experiments / "pendulum")
    shutil.copyfile(folder / "experiment.yaml", experiments / "pendulum" / "experiment.yaml")
    shutil.copytree(folder / "fit", experiments / "pendulum" / "models" / "m1" / "f1")
    shutil.copyfile(folder / "story.json", experiments / "pendulum" / "models" / "story.json")
    (experiments / "arm").mkdir()
    shutil.copyfile(folder / "arm.yaml", experiments / "arm" / "experiment.yaml")
    connection = sqlite3.connect(data_folder / "service.sqlite")
    connection.executescript((folder / "service.sql").read_text())
    connection.close()
    return start_service()


def test_people_sign_in_as_before_and_their_changes_are_in_one_chain(upgraded):
    assert upgraded.browser("ada").get("/me").json()["role"] == "admin"
    log = upgraded.service.audit.rows()
    assert [row.action for row in log][:2] == [
        "POST /sign-in",
        "POST /experiments/{experiment}/sessions/{session}/weigh",
    ]
    assert len(log) > 4
    assert upgraded.service.audit.check().ok


def test_the_session_that_was_being_prepared_is_there_with_its_weighed_mass(upgraded):
    found = upgraded.client(Role.VIEWER, "eve").get("/experiments/arm/sessions/session-00").json()
    assert (found["state"], found["weighed"], found["payload"]["name"]) == ("new", 0.0, "none")


def test_the_stored_model_and_its_diagnosis_are_read_and_the_next_fit_follows_them(upgraded, finished):
    client = upgraded.client(Role.OPERATOR, "grace")
    results = client.get("/experiments/pendulum/results").json()
    assert results["version"]["id"] == "m1"
    assert results["diagnosis"]["joints"][0]["joint"] == "j1"
    assert 0 < results["relative_error"] < 0.2
    for page in ("model", "missing", "results", "sessions"):
        assert client.get(f"/pages/experiments/pendulum/{page}").status_code == 200, page
    job = client.post("/experiments/pendulum/models/effects", json={"effect": "load-friction"}).json()
    assert finished(client, job)["state"] == "done"
    assert client.get("/experiments/pendulum/models").json()["line"] == ["m1", "m2"]


def test_a_backup_taken_before_the_upgrade_is_restored_after_it(upgraded, data_folder, tmp_path):
    write_backup(data_folder, tmp_path / "before.tar")
    restore_backup(tmp_path / "before.tar", tmp_path / "restored")
    with open_data(tmp_path / "restored", None) as opened:
        assert opened.experiments.reindex() == 2
        assert [row.name for row in opened.accounts.users()] == ["ada"]
