"""Motion errors of identified models on plants that share no code with the identifier, and on a real drive."""

from __future__ import annotations

import json
import subprocess
import sys

import numpy as np
import pytest

from identify import identify, load_experiment, simulate
from identify.recording import InputError
from identify.recording.controller_file import ControllerFile, JointController
from identify.simulation.simulate import simulated
from tests.plants.planar_arm import draw_planar_arm, record_arm
from tests.plants.single_joint import record, write_experiment


def error(document, horizon, role="identification", usual=False):
    (row,) = [own for own in document.horizons if own.horizon == horizon and own.role == role]
    return row.joints[0].position_rms_usual if usual else row.joints[0].position_rms


@pytest.fixture(scope="module")
def stribeck(tmp_path_factory):
    return write_experiment(
        tmp_path_factory.mktemp("plant") / "bench",
        record({"stribeck": 1.5}, seed=11, duration=12.0, payload_masses=(0.0, 4.0)),
    )


def test_the_effect_that_was_hidden_mends_the_motion_too(stribeck):
    document = simulate(load_experiment(stribeck), "usual", ["stribeck"], [0.5])
    assert error(document, 0.5) < 0.5 * error(document, 0.5, usual=True)
    assert {(own.effect, own.joint) for own in document.effects} >= {
        ("stribeck", document.horizons[0].joints[0].joint)
    }
    assert {each.formed for each in document.formed} == {"instant"}
    assert document.inputs == ("recorded torque",)
    assert document.along_record == ()


def test_what_gives_is_told_and_what_else_the_record_is_asked_for(stribeck):
    """No gap is hidden: what is found is near the finest that the encoder shows."""
    document = simulate(
        load_experiment(stribeck),
        "usual",
        ["stribeck", "backlash", "friction-warmup"],
        [0.1],
        free_run=False,
    )
    formed = {each.effect: (each.formed, each.state) for each in document.formed}
    assert formed.pop("backlash") == ("give", "position and speed of the link")
    assert set(formed.values()) == {("instant", None)}
    (remark,) = document.remarks
    assert remark.startswith("elbow: a gap of ")
    assert document.inputs == ("recorded torque", "time")


def test_figures_of_each_joint_are_those_of_its_own_course_sample_by_sample(tmp_path):
    """An arm that nothing holds leaves its record, one joint after the other."""
    arm = draw_planar_arm(np.random.default_rng(4), 2)
    folder = record_arm(
        tmp_path / "arm", arm, 0, {"load-friction": 8.0}, seed=5, duration=6.0, rate=100.0, payloads=(0.0,)
    )
    courses = []
    document = simulated(
        identify(load_experiment(folder)), None, [], "torque", free_run=True, keep=courses.append
    )
    (course,) = courses
    (row,) = document.horizons
    left = []
    for joint, figures in enumerate(row.joints):
        off = course.model_q[:, joint] - course.q[:, joint]
        faster = course.model_dq[:, joint] - course.dq[:, joint]
        assert figures.position_rms == pytest.approx(np.sqrt(np.nanmean(off**2)), rel=1e-9)
        assert figures.velocity_rms == pytest.approx(np.sqrt(np.nanmean(faster**2)), rel=1e-9)
        beyond = np.flatnonzero(np.abs(off) > 0.1 * np.ptp(course.q[:, joint]))
        left.append(course.time[beyond[0]] if len(beyond) else None)
    assert [figures.left_record_at for figures in row.joints] == pytest.approx(left)
    assert None not in left
    assert left[0] != left[1]


def test_every_session_and_role_has_its_figures(stribeck):
    document = simulate(load_experiment(stribeck), "usual", [], [0.5])
    experiment = load_experiment(stribeck)
    assert {row.horizon for row in document.horizons} == {0.5, None}
    for row in document.horizons:
        assert [own.file for own in row.sessions] == [
            e.file for e in experiment.sessions if e.role == row.role
        ]
        assert row.joints[0].position_rms_usual is None  # the model is the usual one
        assert row.energy_drift is not None
        assert row.energy_drift < 0.02


def test_with_the_known_controller_the_emps_drive_stays_on_its_reference(emps, tmp_path):
    """Gains of the record's own README: v = 243.45 (160.18 (q_ref − q) − q̇)."""
    gains = tmp_path / "controller.yaml"
    gains.write_text(
        f"joints: [{{joint: slide, position: {243.45 * 160.18}, velocity: 243.45, limit: 10}}]\n"
    )
    experiment = load_experiment(emps)
    document = simulate(experiment, "usual", ["delay"], [1.0], gains, free_run=False)
    assert {each.formed for each in document.formed if each.effect == "delay"} == {"state"}
    assert document.inputs == ("reference position",)
    free = simulate(experiment, "usual", [], [1.0], free_run=False)
    assert document.controller is not None
    assert document.controller.source == "file"
    assert error(document, 1.0) < 0.5 * error(free, 1.0)
    estimated = simulate(experiment, "usual", [], [1.0], "estimate", free_run=False)
    assert estimated.controller is not None
    assert estimated.controller.joints[0].position == pytest.approx(243.45 * 160.18, rel=0.1)
    assert estimated.controller.joints[0].velocity == pytest.approx(243.45, rel=0.1)


@pytest.mark.parametrize("horizon", [0.0, -1.0, float("nan"), float("inf")])
def test_a_horizon_that_is_no_time_is_refused(stribeck, horizon):
    with pytest.raises(InputError, match="must be a time in seconds above zero"):
        simulate(load_experiment(stribeck), "usual", [], [horizon])


def test_a_horizon_within_a_sample_is_refused_or_left_out(stribeck):
    experiment = load_experiment(stribeck)
    with pytest.raises(
        InputError, match=r"a horizon of 1e-09 s ends before the next sample; must be 0.00\d* s or more"
    ):
        simulate(experiment, "usual", [], [1e-9], free_run=False)
    document = simulate(experiment, "usual", [], [1e-9, 0.5], free_run=False)
    assert {each.horizon for each in document.horizons} == {0.5}
    assert any(
        "a sample is longer than the horizon of 1e-09 s, left out" in said for said in document.remarks
    )


@pytest.mark.parametrize(
    ("gains", "said"),
    [
        ({"position": -9e3, "velocity": 50.0}, "'slide': position -9000 drives it away.*must be positive"),
        ({"position": 4e4, "velocity": 1e12}, "loop of .* rad/s.*beyond.*'slide': velocity 1e\\+12"),
        ({"position": 4e9, "velocity": 250.0}, "loop of .* rad/s.*beyond.*'slide': position 4e\\+09"),
    ],
)
def test_gains_that_no_machine_has_are_refused(emps, gains, said):
    controllers = ControllerFile(joints=(JointController(joint="slide", **gains),))
    with pytest.raises(InputError, match=said):
        simulate(load_experiment(emps), "usual", [], [0.1], controllers, free_run=False)


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("joints: []\n", "joints"),
        ("joints: [{joint: other, position: 1, velocity: 1}]\n", "one controller for each joint"),
        ("joints: [{joint: j1, position: high, velocity: 1}]\n", "position"),
    ],
)
def test_a_wrong_controller_file_is_refused_with_the_field(stribeck, tmp_path, text, said):
    file = tmp_path / "controller.yaml"
    file.write_text(text)
    with pytest.raises(InputError, match=said):
        simulate(load_experiment(stribeck), "usual", [], [0.5], file)


def test_a_reference_that_is_no_command_is_told_what_it_is(stribeck):
    loop = ControllerFile(
        joints=(JointController(joint="elbow", reference="q1", position=1.0, velocity=1.0),)
    )
    said = (
        "reference: column 'q1' is the measured position of joint 1, and not the position that was commanded"
    )
    with pytest.raises(InputError, match=said):
        simulate(load_experiment(stribeck), "usual", [], [0.5], loop)


def test_a_record_without_a_reference_is_told_so(stribeck):
    with pytest.raises(InputError, match="no column 'qref1'"):
        simulate(load_experiment(stribeck), "usual", [], [0.5], "estimate")


def test_the_command_prints_one_document(stribeck):
    command = [sys.executable, "-m", "api", "simulate", str(stribeck), "--horizon", "0.5", "--json"]
    done = subprocess.run(command, capture_output=True, text=True, check=True)
    document = json.loads(done.stdout)
    assert document["controller"] is None
    joint = document["horizons"][0]["joints"][0]
    assert {"joint", "position_rms", "velocity_rms", "unit", "windows", "left_record_at"} <= set(joint)
    assert joint["unit"] == "rad"
    assert np.isfinite(joint["position_rms"])
    longer = subprocess.run(
        [*command[:-3], "--horizon", "1000", "--no-free-run", "--json"],
        capture_output=True,
        text=True,
        check=False,
    )
    assert (longer.returncode, longer.stdout) == (2, "")
    assert "longer than every session" in longer.stderr
    assert longer.stderr.count("\n") == 1
    wrong = subprocess.run([*command[:-3], "--horizon", "-2"], capture_output=True, text=True, check=False)
    assert wrong.returncode == 2
    assert wrong.stdout == ""
    assert wrong.stderr.count("\n") == 1


def test_a_joint_that_stands_still_in_the_whole_record_stays_where_it_is(tmp_path):
    """An arm whose second joint is held at 0.4 rad by a torque that no inertia answers: a pendulum at its first joint."""
    time = np.arange(0.0, 12.0, 0.005)
    rates = np.array([1.1, 2.3, 3.7])
    q, dq, ddq = (
        np.sum([a * f for a, f in zip((0.6, 0.3, 0.1), course, strict=True)], axis=0)
        for course in (
            [np.sin(w * time) for w in rates],
            [w * np.cos(w * time) for w in rates],
            [-(w**2) * np.sin(w * time) for w in rates],
        )
    )
    torque = 3.0 * ddq + 30.0 * np.cos(q + 0.1) + 2.0 * dq + 3.0 * np.sign(dq)
    holding = 7.8 * np.cos(q + 0.4)
    rows = np.column_stack([time, q, np.full(len(time), 0.4), torque, holding])
    np.savetxt(tmp_path / "one.csv", rows, delimiter=",", header="t,q1,q2,v1,v2", comments="")
    joint = "{name: j%d, type: revolute, alpha: 0, d: %g, theta: 0, r: 0, drive_gain: 1}"
    (tmp_path / "experiment.yaml").write_text(
        "format: 1\nname: held\nrobot:\n  gravity: [0, -9.81, 0]\n  joints:\n"
        f"    - {joint % (1, 0)}\n    - {joint % (2, 0.5)}\n"
        "payloads: [{name: none, mass: 0}]\nsessions: [{file: one.csv, payload: none}]\n"
    )
    document = simulate(load_experiment(tmp_path), "usual", [], [0.1], free_run=False)
    moving, still = document.horizons[0].joints
    assert (still.position_rms, still.velocity_rms) == (0.0, 0.0)
    assert 0.0 < moving.position_rms < 1e-3
    (remark,) = document.remarks
    assert remark.startswith("j2: stands still in the whole record")
