"""The sessions of an experiment on the page: what became of them, recovery, and what was measured elsewhere."""

import fcntl
import json
from pathlib import Path

import h5py
import numpy as np
import pytest

from api.service.accounts import Role

HTML = {"Accept": "text/html", "HX-Request": "true"}


def cut_off(folder: Path, status: str = "recording") -> Path:
    """A recording of 500 rows that nobody closed, as after a power cut; or one that ended with another status."""
    file = folder / "incomplete" / "session-02.h5"
    file.parent.mkdir(exist_ok=True)
    payload = {"name": "disk", "mass": 3.0, "com": [0.5, 0.0, 0.0], "inertia": [0.0] * 6}
    with h5py.File(file, "w", libver="latest") as recording:
        recording.attrs["status"], recording.attrs["status_reason"] = status, ""
        recording.attrs["payload"], recording.attrs["counters"] = json.dumps(payload), "{}"
        for name in ("cycle", "sync_time"):
            recording.create_dataset(name, data=np.arange(500), maxshape=(None,), chunks=(100,))
    return file


def page_of(client, experiment: str) -> str:
    return client.get(f"/pages/experiments/{experiment}/sessions", headers=HTML).text


def test_what_was_cut_off_is_said_and_recovered_by_one_press(imported, service):
    client, experiment = imported
    cut_off(service.service.experiments.folder(experiment))
    service.service.experiments.reindex()
    assert "1 recording was cut off." in page_of(client, experiment)
    listed = client.get("/pages/experiments", headers=HTML).text
    assert "1 cut off" in listed
    address = f"/pages/experiments/{experiment}/sessions/session-02/recover"
    answer = client.post(address, headers=HTML)
    assert answer.status_code == 200
    assert "cut off" not in answer.text
    assert "the recording process died; recovered by the-operator" in answer.text
    assert client.post(address, headers=HTML).status_code == 409
    assert service.client(Role.VIEWER).post(address, headers=HTML).status_code == 403


def test_what_was_stopped_is_offered_for_use_and_refused_in_words_where_it_cannot_serve(imported, service):
    client, experiment = imported
    cut_off(service.service.experiments.folder(experiment), "aborted")
    service.service.experiments.reindex()
    text = page_of(client, experiment)
    assert "stopped; kept, not used" in text
    assert ">Use this session</button>" in text
    answer = client.post(f"/pages/experiments/{experiment}/sessions/session-02/admit", headers=HTML)
    assert answer.status_code == 409
    assert "cannot be used: cannot be judged" in answer.text


def test_a_recording_that_still_grows_is_not_closed_under_its_recorder(imported, service):
    client, experiment = imported
    file = cut_off(service.service.experiments.folder(experiment))
    service.service.experiments.reindex()
    with file.with_suffix(".log").open("wb") as log:
        fcntl.flock(log, fcntl.LOCK_EX)  # as the recorder does for as long as it lives
        answer = client.post(f"/experiments/{experiment}/sessions/session-02/recover")
    assert answer.status_code == 409
    assert "still being recorded" in answer.json()["detail"]


def test_an_experiment_and_a_session_are_added_from_files(
    service, tmp_path, write_measured_experiment, zipped
):
    client = service.client(Role.OPERATOR)
    folder = write_measured_experiment(tmp_path / "measured", sessions=1)
    answer = client.post(
        "/pages/experiments/import", files={"file": ("one.zip", zipped(folder))}, headers=HTML
    )
    assert answer.status_code == 204, answer.text
    assert answer.headers["HX-Redirect"] == "/pages/experiments/pendulum/sessions"
    answer = client.post(
        "/pages/experiments/pendulum/sessions/import",
        files={"file": ("more.csv", (folder / "session-00.csv").read_bytes())},
        data={"payload": "new", "payload_name": "plate", "mass": "1,25", "role": "validation"},
        headers=HTML,
    )
    assert answer.status_code == 204, answer.text
    text = page_of(client, "pendulum")
    assert "plate" in text
    assert "1.250&nbsp;kg" in text
    kinds = [job["kind"] for job in client.get("/jobs", params={"experiment": "pendulum"}).json()]
    # nobody asked for the fits; the first may also be fitted again if it ends between the two
    assert kinds.count("identify") == 2
    assert set(kinds) <= {"identify", "refit"}


@pytest.mark.parametrize(
    ("content", "data", "words"),
    [
        (b"t,q1\n0,0\n", {"payload": "none"}, "v1"),
        (b"", {"payload": "none"}, "<p>more.csv: is empty"),
        (b"t,q1,v1\n", {"payload": "new", "payload_name": "plate", "mass": "heavy"}, "is not a mass"),
        (b"t,q1,v1\n", {"payload": "new"}, "Give the new payload a name"),
        (b"t,q1,v1\n", {"payload": "anvil"}, "is not one of none, disk"),
    ],
)
def test_a_file_that_cannot_be_read_is_refused_in_words_and_not_stored(
    imported, service, content, data, words
):
    client, experiment = imported
    folder = service.service.experiments.folder(experiment)
    before = sorted(folder.iterdir())
    answer = client.post(
        f"/pages/experiments/{experiment}/sessions/import",
        files={"file": ("more.csv", content)},
        data=data,
        headers=HTML,
    )
    assert answer.status_code == 422
    assert words in answer.text
    assert str(folder) not in answer.text
    assert sorted(folder.iterdir()) == before


def test_sessions_without_a_model_are_identified_when_somebody_looks(
    service, tmp_path, write_measured_experiment, finished
):
    client = service.client(Role.OPERATOR)
    write_measured_experiment(service.service.experiments.root / "pendulum")
    service.service.experiments.reindex()
    page = "/pages/experiments/pendulum/model"
    text = client.get(page, headers=HTML).text
    assert "Not identified yet" in text
    assert 'hx-trigger="load, click"' in text
    assert client.post("/pages/experiments/pendulum/steps/fit", headers=HTML).status_code == 204
    assert finished(client, client.get("/jobs").json()[0])["state"] == "done"
    news = client.get("/pages/experiments/pendulum/news", params={"seen": ""}, headers=HTML)
    assert news.headers["HX-Refresh"] == "true"
    assert "Torque over time" in client.get(page, headers=HTML).text


def test_why_the_first_fit_failed_is_said_and_it_is_not_begun_again_by_itself(
    service, write_measured_experiment, finished
):
    client = service.client(Role.OPERATOR)
    folder = write_measured_experiment(service.service.experiments.root / "pendulum", sessions=1)
    (folder / "session-00.csv").write_text("t,q1,v1\n0,0,0\n")
    service.service.experiments.reindex()
    client.post("/pages/experiments/pendulum/steps/fit", headers=HTML)
    assert finished(client, client.get("/jobs").json()[0])["state"] == "failed"
    text = client.get("/pages/experiments/pendulum/model", headers=HTML).text
    assert "load, click" not in text
    news = client.get("/pages/experiments/pendulum/news", params={"seen": ""}, headers=HTML).text
    assert "The fit failed." in news
    assert "session-00.csv" in news
