"""What a person does with an experiment's models, with the real identifier in real processes."""

import pytest

import identify
from tests.api.model_changes import change, results


def test_an_imported_experiment_is_identified_by_itself_with_the_usual_model(imported, service):
    client, experiment = imported
    found = results(client, experiment)
    folder = service.service.experiments.folder(experiment)
    own = identify.identify(identify.load_experiment(folder), model="usual").document()
    assert found["model"] == "usual"
    assert found["parameters"] == own.to_json()["parameters"]
    assert found["relative_error"] == own.relative_error
    assert not found["stale"]
    assert found["job"] is None


def test_adding_the_missing_effect_lets_the_error_fall_and_undo_and_redo_go_back_and_forth(
    imported, finished
):
    client, experiment = imported
    before = results(client, experiment)["relative_error"]
    change(client, experiment, "models/effects", finished, effect="load-friction", joint="j1")
    after = results(client, experiment)["relative_error"]
    assert after < 0.1 * before  # the torque was made with friction that grows with the load

    undone = client.post(f"/experiments/{experiment}/models/undo").json()
    assert undone["version"]["id"] == "m1"
    assert undone["job"] is None
    assert results(client, experiment)["relative_error"] == before
    client.post(f"/experiments/{experiment}/models/redo")
    assert results(client, experiment)["relative_error"] == after
    story = client.get(f"/experiments/{experiment}/models").json()
    assert story["line"] == ["m1", "m2"]
    assert story["versions"][1]["add"] == ["load-friction@j1"]


def test_undo_ends_at_the_first_model_and_redo_at_the_last(imported):
    client, experiment = imported
    for step in ("undo", "redo"):
        answer = client.post(f"/experiments/{experiment}/models/{step}")
        assert answer.status_code == 409
        assert f"nothing to {step}" in answer.json()["detail"]


def test_a_new_model_after_undo_leaves_nothing_to_redo_but_loses_no_version(imported, finished):
    client, experiment = imported
    change(client, experiment, "models/effects", finished, effect="load-friction")
    client.post(f"/experiments/{experiment}/models/undo")
    change(client, experiment, "models/effects", finished, effect="stribeck")
    story = client.get(f"/experiments/{experiment}/models").json()
    assert story["line"] == ["m1", "m3"]
    assert story["undone"] == []
    assert [version["id"] for version in story["versions"]] == ["m1", "m2", "m3"]
    assert client.get(f"/experiments/{experiment}/models/m2").json()["identification"]["model"]


def test_an_effect_of_the_named_model_can_be_removed_too(imported, finished):
    client, experiment = imported
    change(client, experiment, "models/effects/remove", finished, effect="coulomb", joint="j1")
    found = results(client, experiment)
    assert {each["effect"] for each in found["effects"]} == {"viscous", "offset"}
    assert (
        found["relative_error"]
        > client.get(f"/experiments/{experiment}/models/m1").json()["identification"]["relative_error"]
    )
    answer = client.post(
        f"/experiments/{experiment}/models/effects/remove", json={"effect": "coulomb", "joint": "j1"}
    )
    assert answer.status_code == 409


def test_the_diagnosis_names_the_effect_and_stays_with_its_model(imported, finished):
    client, experiment = imported
    assert client.get(f"/experiments/{experiment}/models/m1/diagnosis").status_code == 404
    change(client, experiment, "models/m1/diagnosis", finished)
    diagnosis = client.get(f"/experiments/{experiment}/models/m1/diagnosis").json()
    assert diagnosis["joints"][0]["verdict"] == "missing"
    assert any(name.startswith("load-friction") for name in diagnosis["joints"][0]["missing"])
    assert results(client, experiment)["diagnosis"] == diagnosis


def test_improving_adds_a_version_for_every_step(imported, finished):
    client, experiment = imported
    job = change(client, experiment, "improvement", finished)
    story = client.get(f"/experiments/{experiment}/models").json()
    steps = job["result"]["improvement"]["steps"]
    assert len(story["line"]) == len(steps) >= 2
    assert story["versions"][-1]["cause"] == "improved"
    assert results(client, experiment)["relative_error"] < 0.01


def test_a_session_that_comes_later_makes_the_model_fit_anew_and_keeps_the_older_fit(
    imported, finished, write_measured_experiment, tmp_path
):
    client, experiment = imported
    more = write_measured_experiment(tmp_path / "more", sessions=3)
    with (more / "session-02.csv").open("rb") as stream:
        answer = client.post(
            f"/experiments/{experiment}/sessions/import",
            files={"file": ("third.csv", stream)},
            data={"payload": "none", "role": "validation"},
        )
    assert answer.status_code == 201, answer.text
    assert results(client, experiment)["stale"]
    assert finished(client, answer.json()["job"])["state"] == "done"
    found = results(client, experiment)
    assert not found["stale"]
    assert [fit["sessions"] for fit in found["version"]["fits"]] == [2, 3]
    assert found["relative_error_validation"] is not None


def test_undo_to_a_model_that_has_not_seen_all_sessions_fits_it_anew(
    imported, finished, write_measured_experiment, tmp_path
):
    client, experiment = imported
    change(client, experiment, "models/effects", finished, effect="load-friction")
    more = write_measured_experiment(tmp_path / "more", sessions=3)
    with (more / "session-02.csv").open("rb") as stream:
        answer = client.post(
            f"/experiments/{experiment}/sessions/import",
            files={"file": ("third.csv", stream)},
            data={"payload": "none"},
        )
    finished(client, answer.json()["job"])
    undone = client.post(f"/experiments/{experiment}/models/undo").json()
    assert finished(client, undone["job"])["result"] == {"model": "m1"}
    assert len(results(client, experiment)["sessions"]) == 3


def test_a_second_change_waits_its_turn_by_being_refused(imported, finished):
    client, experiment = imported
    first = client.post(f"/experiments/{experiment}/improvement").json()
    refused = client.post(f"/experiments/{experiment}/models/effects", json={"effect": "stribeck"})
    assert refused.status_code == 409
    assert refused.json()["job"] == first["id"]
    assert client.post(f"/jobs/{first['id']}/cancel").status_code == 202
    assert finished(client, first)["state"] == "cancelled"
    assert client.get(f"/experiments/{experiment}/models").json()["line"] == ["m1"]


def test_unknown_models_effects_and_joints_are_refused_with_what_there_is(imported):
    client, experiment = imported
    answers = [
        client.post(f"/experiments/{experiment}/models", json={"model": "unusual"}),
        client.post(f"/experiments/{experiment}/models", json={"model": "rigid+viscous,magic"}),
        client.post(f"/experiments/{experiment}/models/effects", json={"effect": "magic"}),
        client.post(f"/experiments/{experiment}/models/effects", json={"effect": "viscous", "joint": "j9"}),
    ]
    assert [answer.status_code for answer in answers] == [422] * 4
    assert "usual" in answers[0].json()["detail"]
    assert "j1" in answers[3].json()["detail"]


@pytest.mark.parametrize("joint", ["j1", None])
def test_an_effect_that_the_model_has_already_is_refused(imported, joint):
    client, experiment = imported
    answer = client.post(
        f"/experiments/{experiment}/models/effects", json={"effect": "viscous", "joint": joint}
    )
    assert answer.status_code == 409
    assert "already" in answer.json()["detail"]
