"""The story of an experiment's models, with the real identifier in real processes."""

from api.service.accounts import Role
from tests.api.model_changes import change, results


def test_results_are_asked_for_before_there_are_any(service, tmp_path):
    client = service.client(Role.OPERATOR)
    client.post("/experiments", json={"name": "empty", "rig": "rx130l-joint3-simulated"})
    answer = client.get("/experiments/empty/results")
    assert answer.status_code == 404
    assert "measure or import a session first" in answer.json()["detail"]


def test_two_models_are_compared(imported, finished):
    client, experiment = imported
    change(client, experiment, "models/effects", finished, effect="load-friction")
    compared = client.get(
        f"/experiments/{experiment}/models/compare", params={"first": "m1", "second": "m2"}
    ).json()
    assert compared["added"] == ["load-friction@j1"]
    assert compared["removed"] == []
    assert compared["relative_error_change"] < 0


def test_the_story_outlives_the_service_and_its_database(
    imported, service, start_service, data_folder, finished
):
    client, experiment = imported
    change(client, experiment, "models/effects", finished, effect="load-friction")
    before = results(client, experiment)
    for file in data_folder.glob("service.sqlite*"):
        file.unlink()
    again = start_service()
    assert results(again.client(Role.VIEWER), experiment) == before
