"""A payload that nobody weighed: its ten parameters are asked of the record."""

from __future__ import annotations

import subprocess
import sys

import numpy as np
import pinocchio as pin
import pytest

import identify
from identify.recording import InputError
from identify.recording.session_csv import write_csv_session
from tests.identify.dynamics.random_robots import geometry_of, pinocchio_model
from tests.identify.estimation import simulated_arm

MASS, LEVER = 3.4584, 1.277
DH = [
    (0.0, 0.0, 0.0, 0.3),
    (-1.5708, 0.1, 0.0, 0.0),
    (0.0, 0.5, 0.3, 0.1),
    (1.2, 0.05, 0.0, 0.4),
    (-1.3, 0.1, 0.0, 0.0),
]
BODY = {"mass": 2.5, "com": (0.05, -0.12, 0.2), "inertia": (0.04, 0.01, -0.005, 0.06, 0.008, 0.03)}


def sessions(seed=0):
    random = np.random.default_rng(seed)
    motion, arm = simulated_arm.Motion(), simulated_arm.Arm()
    return {
        name: (simulated_arm.record(motion, arm, random, 40.0, torque_noise=1.0, payload=mass), name)
        for name, mass in (("none", 0.0), ("disk", MASS), ("two disks", 2 * MASS))
    }


@pytest.fixture
def wrongly_declared():
    """The disk is declared three times too heavy."""
    return simulated_arm.experiment(sessions(), [("disk", 3 * MASS), ("two disks", 2 * MASS)])


def test_the_payload_of_one_joint_is_found_whatever_was_declared(wrongly_declared):
    document = identify.identify(wrongly_declared, "usual", unknown_payloads=["disk"]).document()
    found = {own.name: own for own in document.parameters}
    for name, true in {
        "ZZ[disk]": MASS * LEVER**2,
        "MX[disk]": MASS * LEVER,
        "MY[disk]": 0.0,
        "ZZ1R": 30.9,
    }.items():
        assert abs(found[name].value - true) < 4 * found[name].std_robust, name
    assert found["mass_ratio[two disks]"].value == pytest.approx(1.0, abs=0.002)
    masses = {own.payload: own.mass for own in document.payloads}
    assert masses == {"none": 0.0, "disk": None, "two disks": 2 * MASS}


def test_what_one_joint_does_not_feel_of_the_payload_is_said(wrongly_declared):
    document = identify.identify(wrongly_declared, "usual", unknown_payloads=["disk"]).document()
    unseen = ["XX", "XY", "XZ", "YY", "YZ", "MZ", "M"]
    assert list(document.not_identifiable) == [f"{symbol}[disk]" for symbol in unseen]


def test_all_ten_parameters_of_a_body_on_five_joints_are_those_that_pinocchio_moved(tmp_path):
    robot = [("revolute", *placement) for placement in DH]
    geometry = geometry_of((0.0, 0.0, -9.81), robot)
    random = np.random.default_rng(4)
    model = pinocchio_model(geometry)
    for joint in range(1, len(DH) + 1):
        model.inertias[joint] = random_body(random)
    xx, xy, xz, yy, yz, zz = BODY["inertia"]
    body = pin.Inertia(
        BODY["mass"], np.array(BODY["com"]), np.array([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]])
    )
    write_session(tmp_path / "bare.csv", model, random)
    model.inertias[len(DH)] += body
    write_session(tmp_path / "loaded.csv", model, random)
    joints = "".join(
        f"    - {{name: j{k + 1}, type: revolute, alpha: {a}, d: {d}, theta: {t}, r: {r}, drive_gain: 1.0}}\n"
        for k, (a, d, t, r) in enumerate(DH)
    )
    (tmp_path / "experiment.yaml").write_text(
        f"format: 1\nname: five\nrobot:\n  gravity: [0.0, 0.0, -9.81]\n  joints:\n{joints}"
        "payloads: [{name: none, mass: 0.0}, {name: body, mass: 0.0}]\n"
        "sessions: [{file: bare.csv, payload: none}, {file: loaded.csv, payload: body}]\n"
    )
    result = identify.identify(identify.load_experiment(tmp_path), "rigid", unknown_payloads=["body"])
    found = {parameter.name: parameter for parameter in result.parameters}
    about_origin = body.inertia - body.mass * pin.skew(body.lever) @ pin.skew(body.lever)
    truth = dict(zip(("XX", "XY", "XZ", "YY", "YZ", "ZZ"), about_origin[np.triu_indices(3)], strict=True))
    truth |= dict(zip(("MX", "MY", "MZ"), body.mass * body.lever, strict=True)) | {"M": body.mass}
    for name, true in truth.items():
        own = found[f"{name}[body]"]
        assert own.std_robust < 0.05
        assert own.value == pytest.approx(true, abs=max(4 * own.std_robust, 0.002)), name


def random_body(random):
    root = random.normal(size=(3, 3))
    return pin.Inertia(random.uniform(1.0, 5.0), random.uniform(-0.2, 0.2, 3), 0.05 * root @ root.T)


def write_session(path, model, random, duration=30.0, rate=200.0):
    """A sum of slow sinusoids on every joint, and the torque that Pinocchio computes for it, with noise."""
    time = np.arange(round(duration * rate)) / rate
    omega = 2 * np.pi * random.uniform(0.1, 0.8, (4, model.nq))
    phase = omega * time[:, None, None] + random.uniform(0, 2 * np.pi, omega.shape)
    amplitude = random.uniform(0.1, 0.4, omega.shape)
    q, dq = (amplitude * np.sin(phase)).sum(1), (amplitude * omega * np.cos(phase)).sum(1)
    ddq = -(amplitude * omega**2 * np.sin(phase)).sum(1)
    data = model.createData()
    torque = np.array([pin.rnea(model, data, *sample) for sample in zip(q, dq, ddq, strict=True)])
    write_csv_session(path, time, q, torque + 0.02 * random.standard_normal(torque.shape))


@pytest.mark.parametrize(
    ("model", "names", "said"),
    [
        ("usual", ["disc"], "not declared; payloads are none, disk, two disks"),
        ("usual", ["none", "disk", "two disks"], "one with a known payload"),
        ("load-velocity", ["disk"], "needs the load"),
    ],
)
def test_what_cannot_be_asked_is_refused_with_the_reason(wrongly_declared, model, names, said):
    with pytest.raises(InputError, match=said):
        identify.identify(wrongly_declared, model, unknown_payloads=names)


def test_the_command_line_asks_for_it(tmp_path, emps):
    command = [sys.executable, "-m", "api", "identify", str(emps), "--unknown-payload", "none"]
    done = subprocess.run(command, capture_output=True, text=True)
    assert done.returncode == 2
    assert "every identification session carries" in done.stderr
