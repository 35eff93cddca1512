"""The catalogue of sessions: what is known of each, exclusion with its reason, roles, notes, and what models then use."""

from types import SimpleNamespace

import pytest

import identify
from api.service.accounts import Role
from api.service.session_catalogue import CatalogueEntry, SessionCatalogue


def changed(client, experiment, session, finished, **body):
    """Change a session and wait until every version is fitted to the data as they then are."""
    answer = client.patch(f"/experiments/{experiment}/sessions/{session}", json=body)
    assert answer.status_code == 200, answer.text
    while jobs := [job for job in client.get("/jobs").json() if job["state"] in ("queued", "running")]:
        finished(client, jobs[-1])
    return answer.json()["session"]


def test_an_excluded_session_is_left_out_by_every_model_and_named_with_its_reason(
    imported, finished, service
):
    client, experiment = imported
    folder = service.service.experiments.folder(experiment)
    shown = changed(client, experiment, "session-01", finished, excluded="  the disk\nwas loose ")
    assert shown["excluded"] == "the disk was loose"
    results = client.get(f"/experiments/{experiment}/results").json()
    assert [each["file"] for each in results["sessions"]] == ["session-00.csv"]
    assert results["excluded"] == [
        {"file": "session-01.csv", "payload": "disk", "reason": "the disk was loose"}
    ]
    assert not results["stale"]
    # The reason is in the experiment's own file, which the identifier reads wherever it runs.
    alone = identify.identify(identify.load_experiment(folder), model="usual").document()
    assert alone.relative_error == results["relative_error"]
    assert alone.excluded[0].reason == "the disk was loose"
    # What was recorded can still be looked at.
    assert client.get(f"/experiments/{experiment}/recordings/session-01/signals").status_code == 200

    changed(client, experiment, "session-01", finished, excluded=None)
    again = client.get(f"/experiments/{experiment}/results").json()
    assert [each["file"] for each in again["sessions"]] == ["session-00.csv", "session-01.csv"]
    assert again["excluded"] == []
    assert "excluded" not in (folder / "experiment.yaml").read_text()


def test_an_excluded_file_may_be_gone(imported, finished, service):
    client, experiment = imported
    folder = service.service.experiments.folder(experiment)
    changed(client, experiment, "session-01", finished, excluded="no")
    (folder / "session-01.csv").unlink()
    assert len(identify.load_experiment(folder).sessions) == 1


def test_the_last_session_of_the_fit_cannot_be_taken_from_it(imported, finished):
    client, experiment = imported
    changed(client, experiment, "session-01", finished, role="validation")
    address = f"/experiments/{experiment}/sessions/session-00"
    for body in ({"excluded": "cold"}, {"role": "validation"}):
        answer = client.patch(address, json=body)
        assert answer.status_code == 409
        assert "Measure or include another" in answer.json()["detail"]
    answer = client.patch(address, json={"excluded": "  "})
    assert answer.status_code == 422
    assert "reason" in answer.json()["detail"]
    viewer = client.patch(address, json={"excluded": "x"}, headers={"Authorization": "Bearer nobody"})
    assert viewer.status_code == 401


@pytest.mark.parametrize("wrong", [{"excluded": "  "}, {"role": "validation"}, {"exclude": "misspelt"}])
def test_a_change_of_which_a_part_is_refused_is_not_made_at_all(imported, finished, wrong):
    client, experiment = imported
    changed(client, experiment, "session-01", finished, role="validation")
    address = f"/experiments/{experiment}/sessions/session-00"
    before = client.get(address).json()
    assert client.patch(address, json={"note": "cold", **wrong}).status_code in (409, 422)
    assert client.get(address).json() == before


def test_after_a_change_of_the_data_every_shown_version_is_fitted_again(imported, finished, service):
    client, experiment = imported
    for effect in ("load-friction", "stribeck"):
        job = client.post(f"/experiments/{experiment}/models/effects", json={"effect": effect}).json()
        finished(client, job)
    client.post(f"/experiments/{experiment}/models/undo")
    changed(client, experiment, "session-01", finished, excluded="the disk was loose")
    story = client.get(f"/experiments/{experiment}/models").json()
    newest = [version["fits"][-1] for version in story["versions"]]
    assert len({fit["data"] for fit in newest}) == 1
    assert [fit["sessions"] for fit in newest] == [1, 1, 1]
    assert [len(version["fits"]) for version in story["versions"]] == [2, 2, 2]
    kinds = [job["kind"] for job in client.get("/jobs", params={"experiment": experiment}).json()]
    assert kinds.count("refit") == 2


def test_a_note_is_kept_and_fits_nothing_again(imported, finished, service):
    client, experiment = imported
    before = client.get(f"/experiments/{experiment}/models").json()
    shown = changed(client, experiment, "session-00", finished, note=" second try, kälter ")
    assert shown["note"] == "second try, kälter"
    assert client.get(f"/experiments/{experiment}/models").json() == before
    assert not client.get(f"/experiments/{experiment}/results").json()["stale"]
    assert changed(client, experiment, "session-00", finished, note="")["note"] == ""
    (service.service.experiments.folder(experiment) / "notes.yaml").write_text("- 1")
    answer = client.get(f"/experiments/{experiment}/sessions")
    assert answer.status_code == 422
    assert "notes.yaml: must map session files to texts" in answer.json()["detail"]


def test_a_viewer_changes_nothing(imported, service):
    _client, experiment = imported
    viewer = service.client(Role.VIEWER)
    answer = viewer.patch(f"/experiments/{experiment}/sessions/session-00", json={"note": "x"})
    assert answer.status_code == 403


def test_sessions_of_another_rig_are_warned_of_by_both_names(imported, service):
    _client, experiment = imported
    warning = service.service.catalogue.other_rig(experiment, "bench")
    assert warning.startswith("The sessions of pendulum were measured on a rig that is not named")
    assert "the rig chosen is bench" in warning
    assert service.service.catalogue.rigs(experiment) == []


def entry(created, of_row, of_file):
    """A session as the catalogue describes it, with the rig by the database and by its file."""
    return CatalogueEntry(
        SimpleNamespace(created=created, rig=of_row, plan=of_row),  # type: ignore[arg-type]
        SimpleNamespace(rig=of_file, plan=of_file),  # type: ignore[arg-type]
        None,
        "",
    )


def test_the_rigs_of_an_experiment_are_named_once_each_the_newest_last(monkeypatch):
    listed = [entry(3, "bench", None), entry(1, "lab", None), entry(2, None, "bench"), entry(4, None, "hall")]
    listed += [entry(0, "bench", None), entry(5, None, None)]
    catalogue = SessionCatalogue(None, None, None)  # type: ignore[arg-type]
    monkeypatch.setattr(catalogue, "entries", lambda experiment: listed)
    assert catalogue.rigs("arm") == ["lab", "bench", "hall"]


def test_rig_and_plan_are_what_the_database_says_and_else_what_the_file_does():
    assert [entry(0, *pair).rig for pair in (("a", "b"), (None, "b"), ("a", None), (None, None))] == [
        "a",
        "b",
        "a",
        None,
    ]
    assert [entry(0, *pair).plan for pair in (("a", "b"), (None, "b"), ("a", None), (None, None))] == [
        "a",
        "b",
        "a",
        None,
    ]
