"""Payload sessions through the service, on the simulated rig: real processes, real recordings."""

import shutil

import h5py
import numpy as np
import yaml

from api.service.accounts import Role
from daq.rig import RIGS
from tests.api.rig_session import RIG, STEPS, operator, prepare, take, watch

__all__ = ["operator"]


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


def test_a_rig_file_that_is_changed_after_the_check_has_to_be_checked_again(operator, service, data_folder):
    own = data_folder / "rigs" / f"{RIG}.yaml"
    own.parent.mkdir(exist_ok=True)
    shutil.copy(RIGS / own.name, own)
    prepare(operator)
    assert take(operator, "session-00", "weigh", "check", "confirm", mass=0.0).status_code == 200
    own.write_text(own.read_text().replace("following_error: 0.05", "following_error: 0.04"))
    refused = take(operator, "session-00", "arm")
    assert refused.status_code == 409
    said = refused.json()["detail"]
    assert (
        said
        == f"cannot arm: rigs/{RIG}.yaml was changed since it was read for this session; check the rig again"
    )
    session = operator.get("/experiments/arm/sessions/session-00").json()
    assert (session["state"], session["reason"]) == ("aborted", said.removeprefix("cannot arm: "))
    # The same session goes on once it is checked by what the file says now.
    assert take(operator, "session-00", "check", "confirm", "arm").status_code == 200
    assert service.service.sessions.active(RIG).payload_session.rig.axes[0].limits.following_error == 0.04
    plan = data_folder / "plans" / "short.json"
    plan.write_text(plan.read_text() + "\n")
    assert "plans/short.json was changed since" in take(operator, "session-00", "start").json()["detail"]
    assert operator.get("/experiments/arm/sessions/session-00").json()["state"] == "aborted"


def test_a_payload_that_is_another_in_the_rig_file_by_now_is_not_mounted_for_it(operator, data_folder):
    own = data_folder / "rigs" / f"{RIG}.yaml"
    own.parent.mkdir(exist_ok=True)
    document = yaml.safe_load((RIGS / own.name).read_text())
    document["payloads"].append({"name": "bar", "mass": 2.0, "com": [1.0, 0.0, 0.0]})
    own.write_text(yaml.safe_dump(document))
    prepare(operator, "bar")
    document["payloads"][-1]["mass"] = 3.0
    own.write_text(yaml.safe_dump(document))
    refused = take(operator, "session-00", "check")
    assert refused.status_code == 422
    assert "has another payload bar (3.0 kg, not 2.0 kg)" in refused.json()["detail"]


def test_one_session_of_an_experiment_is_prepared_at_a_time_and_can_be_discarded(operator):
    prepare(operator)
    assert operator.post(f"/rigs/{RIG}/release").status_code in (200, 204)
    assert "session-00 is being prepared" in prepare(operator).json()["detail"]
    assert operator.get(f"/rigs/{RIG}").json()["operator"] is None  # what is refused takes nothing
    assert operator.delete("/experiments/arm/sessions/session-00").status_code == 204
    assert prepare(operator).json()["id"] == "session-00"


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
