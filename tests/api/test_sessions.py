"""Payload sessions through the service, on the simulated rig: real processes, real recordings."""

import gzip
import io
import json

import h5py
import numpy as np
import pytest

from api.service.accounts import Role
from api.service.live import decode_block

RIG = "rx130l-joint3-simulated"
STEPS = ("check", "confirm", "arm", "start")


@pytest.fixture
def operator(service, finished):
    """An operator with a plan and an empty experiment `arm`."""
    client = service.client(Role.OPERATOR)
    job = client.post("/plans", json={"rig": RIG, "name": "short", "seconds": 20, "model": "usual"}).json()
    assert finished(client, job)["state"] == "done"
    assert client.post("/experiments", json={"name": "arm", "rig": RIG}).status_code == 201
    return client


def prepare(client, payload="none"):
    new = {"rig": RIG, "plan": "short", "payload": {"name": payload}}
    return client.post("/experiments/arm/sessions", json=new)


def take(client, session, *steps, mass=None):
    """Take steps of a session; returns the last answer, after the first that was refused."""
    answer = None
    for step in steps:
        body = {"json": {"mass": mass}} if step == "weigh" else {}
        answer = client.post(f"/experiments/arm/sessions/{session}/{step}", **body)
        if answer.status_code != 200:
            break
    return answer


def watch(client, until=()):
    """Look at the rig live until the session's state is one of `until`; returns blocks and the last
    status.
    """
    blocks = []
    with client.websocket_connect(f"ws://localhost:8000/rigs/{RIG}/live") as connection:
        while True:
            message = connection.receive()
            if message.get("bytes"):
                blocks.append(decode_block(message["bytes"]))
                continue
            status = json.loads(message["text"])
            if status["session"] and status["session"]["state"] in (*until, "done", "aborted", "faulted"):
                return blocks, status


def test_a_session_is_measured_recorded_and_identified_by_itself(operator, service, finished):
    assert prepare(operator).json()["id"] == "session-00"
    answer = take(operator, "session-00", "weigh", *STEPS, mass=0.0)
    assert answer.status_code == 200, answer.text
    blocks, status = watch(operator)
    assert status["session"]["state"] == "done", status
    assert status["session"]["fraction"] == 1.0

    session = operator.get("/experiments/arm/sessions/session-00").json()
    assert session["state"] == "done"
    assert session["file"] == "session-00.h5"
    job = operator.get("/jobs", params={"experiment": "arm"}).json()[0]
    assert finished(operator, job)["state"] == "done"
    results = operator.get("/experiments/arm/results").json()
    assert [each["file"] for each in results["sessions"]] == ["session-00.h5"]
    assert results["relative_error"] < 0.2

    # What was seen live is what was recorded.
    assert blocks
    path = service.service.experiments.folder("arm") / "session-00.h5"
    with h5py.File(path) as recording:
        counts = recording["position"]
        recorded = counts[:] @ counts.attrs["matrix"].T + counts.attrs["offset"]
    for _origin, values, axes in blocks:
        assert axes == 1
        seen = values[1][np.isfinite(values[1])]
        assert recorded.min() - 1.0 < seen.min() <= seen.max() < recorded.max() + 1.0


def test_recordings_are_downloaded_as_hdf5_csv_and_raw_frames(operator, service):
    prepare(operator)
    take(operator, "session-00", "weigh", *STEPS, mass=0.0)
    watch(operator)
    listed = operator.get("/experiments/arm/recordings").json()
    assert listed[0]["formats"] == ["original", "csv", "mat", "parquet", "hdf5-si", "hdf5", "raw"]
    folder = service.service.experiments.folder("arm")
    address = "/experiments/arm/recordings/session-00"
    assert operator.get(address, params={"format": "hdf5"}).content == (folder / "session-00.h5").read_bytes()
    raw = gzip.decompress((folder / "session-00.log.gz").read_bytes())
    assert operator.get(address, params={"format": "raw"}).content == raw
    assert raw.endswith(b"\n")
    lines = operator.get(address, params={"format": "csv"}).text.splitlines()
    assert lines[0] == "t,q1,v1"
    with h5py.File(folder / "session-00.h5") as recording:
        counts, command = recording["position"], recording["command"]
        q = counts[100] @ counts.attrs["matrix"].T + counts.attrs["offset"]
        v = command[100] * command.attrs["scale"]
        t = (recording["sync_time"][100] - recording["sync_time"][0]) * 1e-9
    np.testing.assert_allclose(np.array(lines[101].split(","), float), [t, q[0], v[0]], rtol=1e-12, atol=1e-9)
    in_si = h5py.File(io.BytesIO(operator.get(address, params={"format": "hdf5-si"}).content))
    assert in_si["q1"].attrs["unit"] == "rad"
    np.testing.assert_allclose([in_si[name][100] for name in ("t", "q1", "v1")], [t, q[0], v[0]], rtol=1e-12)


def test_everybody_who_is_signed_in_stops_the_motion_and_what_was_measured_is_kept(operator, service):
    prepare(operator)
    take(operator, "session-00", "weigh", *STEPS, mass=0.0)
    looker = service.client(Role.VIEWER, "grace")
    watch(operator, until=("running",))
    assert looker.post(f"/rigs/{RIG}/stop").json() == {"stopped": True}
    _blocks, status = watch(operator)
    assert status["session"]["state"] == "aborted"
    assert "grace" in status["session"]["reason"]
    # Harmless when repeated, also when nothing is under way.
    assert looker.post(f"/rigs/{RIG}/stop").json() == {"stopped": False}
    assert looker.post("/experiments/arm/sessions/session-00/stop").json() == {"stopped": False}
    # Only a complete session is identified, and a glimpse of motion serves nobody even after a look at it.
    assert operator.get("/experiments/arm/results").status_code == 404
    refused = operator.post("/experiments/arm/sessions/session-00/admit")
    assert refused.status_code == 409


def test_the_next_session_after_a_stop_is_measured_like_any_other(operator, finished):
    prepare(operator)
    take(operator, "session-00", "weigh", *STEPS, mass=0.0)
    watch(operator, until=("running",))
    operator.post(f"/rigs/{RIG}/stop")
    watch(operator)
    page = operator.get("/pages/experiments/arm/sessions", headers={"Accept": "text/html"}).text
    assert "stopped by the-operator" in page
    session = prepare(operator, "disk-7").json()
    answer = take(operator, session["id"], "weigh", *STEPS, mass=6.97)
    assert answer.status_code == 200, answer.text
    _blocks, status = watch(operator)
    assert status["session"]["state"] == "done", status


def test_steps_out_of_turn_and_a_wrong_payload_are_refused_in_words(operator):
    prepare(operator, "disk-7")
    for step in ("confirm", "arm", "start"):
        answer = take(operator, "session-00", step)
        assert answer.status_code == 409
        assert answer.json()["detail"] == "Check the rig first."
    assert take(operator, "session-00", "check").json()["ok"]
    assert take(operator, "session-00", "confirm").json()["detail"] == "Weigh the payload first."
    assert "must be payload confirmed" in take(operator, "session-00", "arm").json()["detail"]
    wrong = take(operator, "session-00", "weigh", "confirm", mass=3.4584)
    assert wrong.status_code == 422
    assert "6.97 kg" in wrong.json()["detail"]
    right = take(operator, "session-00", "weigh", "confirm", mass=6.971)
    assert right.json()["state"] == "payload confirmed"


def test_without_a_scale_the_operator_is_told_to_type_the_mass(operator):
    prepare(operator)
    answer = take(operator, "session-00", "weigh")
    assert answer.status_code == 409
    assert "type the mass" in answer.json()["detail"]


def test_one_session_of_an_experiment_is_prepared_at_a_time_and_can_be_discarded(operator):
    prepare(operator)
    assert "session-00 is being prepared" in prepare(operator).json()["detail"]
    assert operator.delete("/experiments/arm/sessions/session-00").status_code == 204
    assert prepare(operator).json()["id"] == "session-00"


def test_a_payload_of_ones_own_is_taken_and_one_of_a_known_name_but_another_mass_is_not(operator):
    new = {"rig": RIG, "plan": "short", "payload": {"name": "brick", "mass": 2.5, "com": [1.2, 0, 0]}}
    assert operator.post("/experiments/arm/sessions", json=new).json()["payload"]["mass"] == 2.5
    new["payload"] = {"name": "disk-7", "mass": 2.5}
    answer = operator.post("/experiments/arm/sessions", json=new)
    assert answer.status_code == 422
    assert "another payload disk-7" in answer.json()["detail"]
    new["payload"] = {"name": "unknown"}
    assert operator.post("/experiments/arm/sessions", json=new).status_code == 422


def test_only_one_operator_operates_the_rig_and_the_other_sees_who(operator, service, clock):
    prepare(operator)
    other = service.client(Role.OPERATOR, "grace")
    refused = take(other, "session-00", "check")
    assert refused.status_code == 409
    assert "the-operator operates the rig" in refused.json()["detail"]
    assert other.post(f"/rigs/{RIG}/take").status_code == 409
    assert other.post(f"/rigs/{RIG}/release").status_code == 409
    assert other.get(f"/rigs/{RIG}").json()["onlookers"] == ["grace"]
    assert operator.post(f"/rigs/{RIG}/hand-over", json={"to": "grace"}).json()["operator"] == "grace"
    assert operator.post(f"/rigs/{RIG}/take").status_code == 409
    assert take(other, "session-00", "check").status_code == 200
    assert other.post(f"/rigs/{RIG}/release").json()["operator"] is None
    assert operator.post(f"/rigs/{RIG}/take").json()["operator"] == "the-operator"
    # Whoever left without releasing it does not keep it for ever.
    clock.advance(14 * 60)
    assert other.post(f"/rigs/{RIG}/take").status_code == 409
    clock.advance(2 * 60)
    assert other.post(f"/rigs/{RIG}/take").json()["operator"] == "grace"


def test_a_rig_is_handed_over_to_operators_only(operator, service):
    service.client(Role.VIEWER, "eve")
    operator.post(f"/rigs/{RIG}/take")
    for name in ("eve", "nobody"):
        answer = operator.post(f"/rigs/{RIG}/hand-over", json={"to": name})
        assert answer.status_code == 409
        assert "is not an operator" in answer.json()["detail"]


def test_what_moves_is_in_the_audit_log_before_it_moves(operator, service, monkeypatch):
    prepare(operator)
    take(operator, "session-00", "weigh", "check", "confirm", mass=0.0)
    audit = service.service.audit

    def full_disk(*_arguments, **_named):
        raise OSError(28, "No space left on device")

    monkeypatch.setattr(audit, "append", full_disk)
    assert take(operator, "session-00", "arm").status_code == 500
    assert operator.get("/experiments/arm/sessions/session-00").json()["state"] == "payload confirmed"
    # But a stop needs no log.
    assert operator.post(f"/rigs/{RIG}/stop").json() == {"stopped": True}
    monkeypatch.undo()
    asked = [row.action for row in audit.rows() if row.outcome == "asked"]
    assert asked == []


def test_arming_and_starting_are_logged_as_asked_with_who_and_on_what(operator, service):
    prepare(operator)
    take(operator, "session-00", "weigh", *STEPS, mass=0.0)
    operator.post(f"/rigs/{RIG}/stop")
    watch(operator)
    log = service.client(Role.ADMIN).get("/audit").json()
    asked = {row["action"]: row for row in log if row["outcome"] == "asked"}
    assert set(asked) == {"session arm", "session start"}
    assert asked["session start"]["user"] == "the-operator"
    assert asked["session start"]["target"] == f"rig {RIG}, experiment arm, session-00"
    assert any(row["action"] == "POST /rigs/{rig}/stop" for row in log)


def test_a_recording_whose_process_died_is_recovered_with_what_it_had(operator, service, data_folder):
    prepare(operator)
    take(operator, "session-00", "weigh", *STEPS, mass=0.0)
    watch(operator)
    folder = service.service.experiments.folder("arm")
    # As after a power cut: an open recording that nobody closed.
    incomplete = folder / "incomplete" / "session-01.h5"
    with h5py.File(folder / "session-00.h5") as whole, h5py.File(incomplete, "w", libver="latest") as cut:
        for name, value in whole.attrs.items():
            cut.attrs[name] = value
        cut.attrs["status"] = "recording"
        for name, column in whole.items():
            cut.create_dataset(name, data=column[:3000])
            for key, value in column.attrs.items():
                cut[name].attrs[key] = value
    service.service.experiments.reindex()
    assert operator.get("/experiments/arm/sessions/session-01").json()["state"] == "recording"
    recovered = operator.post("/experiments/arm/sessions/session-01/recover").json()
    assert recovered["state"] == "aborted"
    assert "recovered by the-operator" in recovered["reason"]
    assert operator.get("/experiments/arm/recordings/session-01").status_code == 200
    assert operator.post("/experiments/arm/sessions/session-01/recover").status_code == 409


def test_an_absolute_encoder_drives_that_live_only_in_a_session_and_an_unknown_joint_are_not_homed(operator):
    short_lived = operator.post(f"/rigs/{RIG}/homing", json={"joint": "j3"})
    assert short_lived.status_code == 422
    assert "has an absolute encoder" in short_lived.json()["detail"]
    assert "`coulomb reset" in short_lived.json()["detail"]
    reset = operator.post(f"/rigs/{RIG}/reset")
    assert reset.status_code == 422
    assert "live only as long as a session" in reset.json()["detail"]
    unknown = operator.post(f"/rigs/{RIG}/homing", json={"joint": "j9"})
    assert unknown.status_code == 422
    assert "joint j9" in unknown.json()["detail"]
    assert operator.get(f"/rigs/{RIG}/homing").json() is None
