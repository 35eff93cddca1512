"""Which controllers close a loop: those of the motors, those that a recording holds, or none, and what is said of it."""

from __future__ import annotations

import json

import h5py
import numpy as np
import pytest
import yaml

from api.controller_text import controller_yaml
from api.simulation_text import simulation_text
from identify import load_experiment, simulate
from identify.recording import InputError
from identify.recording.controller_file import ControllerFile, JointController
from identify.simulation.controller import controllers_of, decode_controllers, estimated_controllers
from identify.simulation.measured_motion import MeasuredMotion
from tests.plants.single_joint import record, write_experiment

GEAR = np.array([[-60.0, 0.0, 0.0], [0.0, 45.0, 0.0], [0.0, 32.0, 32.0]])
"""motor velocities = GEAR @ joint velocities: the second motor turns with the third, and the first turns the other way"""
DRIVE_GAIN = GEAR.T * np.array([0.1, 0.2, 0.1])


def moving(names, command=None) -> MeasuredMotion:
    """Three joints that follow sums of sinusoids with errors of their own."""
    period, random = 4e-3, np.random.default_rng(2)
    time = period * np.arange(3000)
    angle = time[:, None, None] * random.uniform(1.0, 9.0, (3, 4)) + random.uniform(0.0, 6.0, (3, 4))
    reference, off = np.sin(angle[..., :2]).sum(-1), 0.01 * np.sin(3.0 * angle[..., 2:]).sum(-1)
    q = reference - off
    return MeasuredMotion(
        period=period,
        time=time,
        q=q,
        dq=np.gradient(q, period, axis=0),
        ddq=np.zeros(q.shape),
        direction=np.sign(q),
        torque=np.zeros(q.shape),
        command=np.zeros(q.shape) if command is None else command,
        external=None,
        temperature=None,
        resting=np.zeros(q.shape, bool),
        recorded=q,
        extra=dict(zip(names, reference.T, strict=True)),
    )


def test_gains_of_coupled_drives_are_told_in_the_coordinates_of_their_motors():
    """The command of each drive is a law of its own motor's angle, GEAR @ q, in motor units."""
    names = ["qref1", "qref2", "qref3"]
    motion = moving(names)
    stiffness, damping, ahead = (
        np.array([9.0, 7.0, 5.0]),
        np.array([0.4, 0.3, 0.2]),
        np.array([0.1, 0.3, 0.25]),
    )
    reference = np.column_stack([motion.extra[name] for name in names]) @ GEAR.T
    angle, speed = motion.q @ GEAR.T, motion.dq @ GEAR.T
    command = (
        stiffness * (reference - angle)
        + ahead * np.gradient(reference, motion.period, axis=0)
        - damping * speed
    )
    found = estimated_controllers([moving(names, command)], ["j1", "j2", "j3"], DRIVE_GAIN)
    own = np.diag(GEAR)
    np.testing.assert_allclose(found.gain("position"), stiffness * own, rtol=1e-6)
    np.testing.assert_allclose(found.gain("velocity"), damping * own, rtol=1e-6)
    np.testing.assert_allclose(found.gain("reference_velocity"), ahead * own, rtol=1e-6)
    # and what they command is what was recorded
    followed = found.reference(motion)
    error = found.error(followed.position, motion.q)
    again = found.command(error, np.zeros(error.shape), followed.ahead, motion.dq)
    np.testing.assert_allclose(again, command, atol=1e-6 * np.abs(command).max())
    # their damping as the joints feel it
    np.testing.assert_allclose(
        found.opposing("velocity", DRIVE_GAIN), DRIVE_GAIN @ np.diag(damping) @ GEAR, rtol=1e-6
    )


def test_a_file_says_whose_coordinates_its_gains_are(tmp_path):
    listed = tuple(JointController(joint=name, position=1.0, velocity=0.0) for name in ("j1", "j2", "j3"))
    q = np.array([[0.1, 0.2, 0.4]])
    for coordinates, seen in (("joints", q[0]), ("motors", GEAR @ q[0] / np.diag(GEAR))):
        file = ControllerFile(coordinates=coordinates, joints=listed)
        controllers = controllers_of(file, ["j1", "j2", "j3"], DRIVE_GAIN, tmp_path)
        np.testing.assert_allclose(controllers.error(np.zeros((1, 3)), q), [-seen], atol=1e-12)


def test_acceleration_and_travel_of_the_reference_are_commanded_ahead(tmp_path):
    law = JointController(
        joint="j1", position=1.0, velocity=0.0, reference_acceleration=2.0, reference_travel=-3.0
    )
    motion = moving(["qref1", "b", "c"])
    period = motion.period
    followed = controllers_of(ControllerFile(joints=(law,)), ["j1"], np.eye(1), tmp_path).reference(motion)
    angle = motion.extra["qref1"]
    wanted = 2.0 * np.gradient(np.gradient(angle, period), period) - 3.0 * (angle - angle[0])
    np.testing.assert_allclose(followed.ahead[:, 0], wanted, atol=1e-9 * np.abs(wanted).max())


HELD = ControllerFile(
    joints=(JointController(joint="elbow", position=3000.0, velocity=60.0, reference_velocity=60.0),),
    read_from=("joint elbow (node 1): position_gain 0x2030:00 = 50000, 50 1/s",),
    left_out=("joint elbow: a filter",),
)


@pytest.fixture(scope="module")
def recordings(tmp_path_factory):
    """Two sessions as recordings of ours that hold the drive's gains."""
    recorded = record({}, seed=3, duration=3.0, payload_masses=(0.0, 3.0), repeats=1)
    folder = write_experiment(tmp_path_factory.mktemp("plant") / "bench", recorded)
    declared = yaml.safe_load((folder / "experiment.yaml").read_text())
    for number, (columns, session) in enumerate(zip(recorded.sessions, declared["sessions"], strict=True)):
        session["file"] = f"session-{number:02d}.h5"
        rows = len(columns["t"])
        with h5py.File(folder / session["file"], "w") as file:
            file["cycle"] = np.arange(rows)
            file["sync_time"] = np.round(1e9 * columns["t"]).astype(np.int64)
            file["position"] = np.round(1e7 * columns["q1"]).astype(np.int64)[:, None]
            file["setpoint"] = np.roll(file["position"][:], -1, axis=0)
            file["command"] = np.round(1e6 * columns["v1"]).astype(np.int64)[:, None]
            file["valid"] = np.full((rows, 1), 3, np.uint8)
            file["position"].attrs["matrix"], file["position"].attrs["offset"] = [[1e-7]], [0.0]
            file["command"].attrs["scale"] = [1e-6]
            file.attrs.update({"format": 1, "cycle": 2e-3, "status": "complete", "rig": "{}"})
            file.attrs["controller"] = HELD.model_dump_json()
    (folder / "experiment.yaml").write_text(yaml.safe_dump(declared))
    return folder


def run(folder, controller=None):
    return simulate(load_experiment(folder), "usual", [], [0.1], controller, free_run=False)


def test_the_gains_that_recordings_hold_close_the_loop_and_are_named(recordings, tmp_path):
    document = run(recordings)
    used = document.controller
    assert used is not None
    assert (used.source, used.read_from) == ("drives", HELD.read_from)
    assert "not in the controllers' law: joint elbow: a filter" in document.remarks
    assert "gains read from the drives before the sessions" in simulation_text(document)
    file = tmp_path / "controllers.yaml"
    file.write_text(controller_yaml(HELD))
    by_file = run(recordings, file)
    assert by_file.controller is not None
    assert by_file.controller.joints == used.joints
    assert by_file.horizons == document.horizons
    assert decode_controllers(file.read_bytes(), "gains.yaml").same_gains(HELD)
    given = run(recordings, HELD.model_copy(update={"read_from": ()}))
    assert given.controller is not None
    assert given.controller.source == "file"
    assert given.horizons == document.horizons
    others = HELD.model_copy(update={"joints": (HELD.joints[0].model_copy(update={"joint": "wrist"}),)})
    with pytest.raises(
        InputError, match=r"^the controller's gains: joints: give one .*: elbow; there are wrist$"
    ):
        run(recordings, others)
    torque = run(recordings, "torque")
    assert torque.controller is None
    assert torque.remarks == ()
    assert torque.horizons != document.horizons


def test_sessions_with_other_gains_or_none_are_driven_by_their_torque_and_it_is_said(recordings):
    path = recordings / "session-01.h5"
    with h5py.File(path, "a") as file:
        other = json.loads(HELD.model_dump_json())
        other["joints"][0]["velocity"] = 61.0
        file.attrs["controller"] = json.dumps(other)
    document = run(recordings)
    assert document.controller is None
    assert document.remarks == (
        "the drives' gains were not the same in all sessions; the recorded torque drives the model",
    )
    with h5py.File(path, "a") as file:
        del file.attrs["controller"]
    assert "session-01.h5: the drives' gains were not read" in run(recordings).remarks[0]
    with pytest.raises(InputError, match=r"with the gains of the drives: session-01\.h5: the drives' gains"):
        run(recordings, "drives")
