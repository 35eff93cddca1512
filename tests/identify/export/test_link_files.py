"""URDF, SDF and MJCF files opened by the programs that they are for: Pinocchio and MuJoCo."""

from __future__ import annotations

import json
import subprocess
import sys
from dataclasses import replace
from types import SimpleNamespace

import mujoco
import numpy as np
import pinocchio as pin
import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st

from identify import load_experiment
from identify.dynamics.geometry import Geometry
from identify.dynamics.payload import payload_torque
from identify.dynamics.rotations import (
    RIGHT_PITCH,
    from_quaternion,
    from_roll_pitch_yaw,
    quaternion,
    roll_pitch_yaw,
)
from identify.export.exported_model import Torque, exported_model
from identify.export.formula_torque import module_of
from identify.export.joint_friction import joint_parts
from identify.export.link_file_torque import arm_torque_by_own_reader
from identify.export.link_files import (
    WRITERS,
    Body,
    JointFriction,
    LinkFile,
)
from identify.export.record_error import Motion
from identify.export.write import write_export
from identify.identification import identify
from identify.recording.experiment_file import Payload
from tests.identify.dynamics.random_robots import random_motion, robots
from tests.identify.export.described_robot import torque_of_robot
from tests.plants.single_joint import record, write_experiment

NONE = Payload(name="none", mass=0.0)


def random_link_file(description, seed, rotors=True, powers=False, constants=False):
    """Bodies with mass and joints with friction, drawn at random."""
    geometry = Geometry.from_robot(description)
    random = np.random.default_rng(seed)
    bodies, friction = [], []
    for _ in range(geometry.joint_count):
        root = random.uniform(-0.3, 0.3, (3, 3))
        second = root @ root.T + 0.01 * np.eye(3)  # ∫ r rᵀ dm about the centre of mass
        inertia = np.trace(second) * np.eye(3) - second
        bodies.append(Body(float(random.uniform(0.5, 5)), random.uniform(-0.3, 0.3, 3), inertia))
        values = random.uniform(0, 2, 6)
        values[4:] *= powers
        constant = float(random.uniform(-3, 3)) if constants else 0.0
        friction.append(
            JointFriction(*values[:3], values[3] if rotors else 0.0, *values[4:], constant=constant)
        )
    return LinkFile(geometry, tuple(bodies), tuple(friction))


def motion_of(q, dq, ddq):
    return Motion(np.zeros(len(q)), q, dq, ddq, None, NONE)


@settings(max_examples=15, deadline=None)
@given(robots, st.integers(0, 2**32 - 1))
def test_pinocchio_reads_the_urdf_and_finds_the_same_torques(description, seed):
    robot = random_link_file(description, seed, rotors=False)
    n = robot.geometry.joint_count
    model = pin.buildModelFromXML(WRITERS["urdf"](robot, "arm"))
    model.gravity.linear = np.asarray(robot.geometry.gravity)
    data = model.createData()
    q, dq, ddq = random_motion(seed, 4, n)
    found = []
    for row in range(4):
        # a continuous joint is a cosine and a sine there
        place = np.concatenate(
            [
                [q[row, j]] if robot.geometry.prismatic[j] else [np.cos(q[row, j]), np.sin(q[row, j])]
                for j in range(n)
            ]
        )
        found.append(pin.rnea(model, data, place, dq[row], ddq[row]).copy())
    damping = np.array([own.damping for own in robot.friction])
    dry = np.array([own.dry for own in robot.friction])
    assert model.damping == pytest.approx(damping)
    springless = LinkFile(
        robot.geometry, robot.bodies, tuple(JointFriction(own.damping, own.dry) for own in robot.friction)
    )
    exact = torque_of_robot(springless)(motion_of(q, dq, ddq))
    assert np.array(found) + damping * dq + dry * np.sign(dq) == pytest.approx(exact, rel=1e-6, abs=1e-6)


@settings(max_examples=15, deadline=None)
@given(robots, st.integers(0, 2**32 - 1))
def test_mujoco_reads_the_mjcf_and_finds_the_same_torques(description, seed):
    robot = random_link_file(description, seed, powers=seed % 2 == 0)
    dry = tuple(replace(own, dry=0.0) for own in robot.friction)
    without = LinkFile(robot.geometry, robot.bodies, dry)
    model = mujoco.MjModel.from_xml_string(WRITERS["xml"](without, "arm"))
    data = mujoco.MjData(model)
    q, dq, ddq = random_motion(seed, 4, robot.geometry.joint_count)
    found = []
    for row in range(4):
        data.qpos[:], data.qvel[:], data.qacc[:] = q[row], dq[row], ddq[row]
        mujoco.mj_inverse(model, data)
        found.append(data.qfrc_inverse.copy())
    exact = torque_of_robot(without)(motion_of(q, dq, ddq))
    assert np.array(found) == pytest.approx(exact, rel=1e-6, abs=1e-6)


@settings(max_examples=15, deadline=None)
@given(robots, st.integers(0, 2**32 - 1))
def test_mujoco_moves_the_joints_with_the_motor_s_torque_where_a_constant_is_beside_it(description, seed):
    """Forward dynamics: controls of the torque that is written accelerate the joints as they were to be."""
    robot = random_link_file(description, seed, constants=True)
    without = replace(robot, friction=tuple(replace(own, dry=0.0) for own in robot.friction))
    model = mujoco.MjModel.from_xml_string(WRITERS["xml"](without, "arm"))
    data = mujoco.MjData(model)
    q, dq, ddq = random_motion(seed, 4, robot.geometry.joint_count)
    torque = torque_of_robot(without)(motion_of(q, dq, ddq))
    assert model.nu == robot.geometry.joint_count
    for row in range(4):
        data.qpos[:], data.qvel[:], data.ctrl[:] = q[row], dq[row], torque[row]
        mujoco.mj_forward(model, data)
        assert data.qacc == pytest.approx(ddq[row], rel=1e-6, abs=1e-6)


def test_mujoco_s_dry_friction_is_that_of_the_file_at_speed_and_creeps_at_rest():
    """What the certificate says of MJCF: a sliding joint loses the dry friction, a held one moves all the same."""
    level = SimpleNamespace(
        gravity=(0.0, 0.0, -9.81),
        joints=[
            SimpleNamespace(
                name="j", type="prismatic", alpha=np.pi / 2, d=0.0, theta=0.0, r=0.0, motor_ratio=1.0
            )
        ],
    )
    robot = LinkFile(
        Geometry.from_robot(level), (Body(2.0, np.zeros(3), 0.01 * np.eye(3)),), (JointFriction(0.0, 3.0),)
    )
    model = mujoco.MjModel.from_xml_string(WRITERS["xml"](robot, "slide"))
    data = mujoco.MjData(model)
    data.qvel[:] = 1.0
    for _ in range(50):
        mujoco.mj_step(model, data)
    assert data.qvel[0] == pytest.approx(1.0 - 3.0 / 2.0 * data.time, rel=1e-3)
    held = mujoco.MjData(model)
    held.qfrc_applied[:] = 2.0  # below the dry friction
    for _ in range(1000):
        mujoco.mj_step(model, held)
    assert 0 < abs(held.qpos[0]) < 0.1


@given(st.lists(st.floats(-1, 1), min_size=4, max_size=4).filter(lambda v: np.linalg.norm(v) > 0.1))
@example(values=[1.0, 1e-8, 1.0, 0.0])  # a hair beside a right pitch, where roll and yaw are hardly two
def test_rotations_survive_both_of_their_forms(values):
    rotation = from_quaternion(np.array(values))
    assert from_quaternion(quaternion(rotation)) == pytest.approx(rotation, abs=1e-9)
    assert from_roll_pitch_yaw(roll_pitch_yaw(rotation)) == pytest.approx(rotation, abs=4 * RIGHT_PITCH)


@pytest.mark.parametrize("pitch", [np.pi / 2, -np.pi / 2])
@pytest.mark.parametrize("roll", [0.0, 0.7, -2.0])
def test_a_right_angle_of_pitch_is_no_exception(pitch, roll):
    rotation = from_roll_pitch_yaw(np.array([roll, pitch, 0.4]))
    assert from_roll_pitch_yaw(roll_pitch_yaw(rotation)) == pytest.approx(rotation, abs=1e-9)


@pytest.fixture(scope="module")
def plant(tmp_path_factory):
    recorded = record({"load-friction": 1.5}, seed=6, duration=12.0, payload_masses=(0.0, 4.0))
    return write_experiment(tmp_path_factory.mktemp("plant") / "bench", recorded)


@pytest.mark.parametrize("ending", sorted(WRITERS))
def test_the_certificate_s_figure_is_what_the_file_s_torques_give(plant, tmp_path, ending):
    """Errors of the file measured here by the identifier's prediction of the same samples, in another way."""
    result = identify(load_experiment(plant), "usual", ["load-friction"])
    certificate = write_export(result, tmp_path / f"arm.{ending}")
    (joint,) = certificate.joints
    assert "load-friction" in joint.approximated
    assert joint.lost == (() if ending == "xml" else ("offset",))
    assert joint.relative_error_model is not None
    assert joint.relative_error_export is not None
    geometry = result.fitted.record.body.base.geometry
    arm = arm_torque_by_own_reader(tmp_path / f"arm.{ending}", geometry.gravity)
    residual, measured = 0.0, 0.0
    for entry in result.fitted.entries:
        samples = result.fitted.record.samples[entry.file]
        motion = Motion(samples.time, samples.q, samples.dq, samples.ddq, None, entry.payload)
        carried = payload_torque(geometry, motion.payload, motion.q, motion.dq, motion.ddq)
        predicted = arm(motion.q, motion.dq, motion.ddq) + carried
        off = (samples.measured - predicted)[samples.moving]
        residual += float(off @ off)
        measured += float(samples.measured[samples.moving] @ samples.measured[samples.moving])
    # unfiltered here: the parallel filter changes little of a smooth motion
    assert joint.relative_error_export == pytest.approx(np.sqrt(residual / measured), rel=0.1)
    # fitted, not guessed: a tenth more or less of either is no better
    assert joint.relative_error_export < 0.5


def test_mjcf_holds_friction_over_powers_of_the_speed_exactly(plant, tmp_path):
    """MuJoCo's torques of the joint are the model's, less the actuator's own."""
    model = exported_model(identify(load_experiment(plant), "usual", ["viscous-quadratic", "viscous-cubic"]))
    (part,) = joint_parts(model, "xml", [], lambda motion: motion.q)
    assert {"viscous", "coulomb", "viscous-quadratic", "viscous-cubic", "offset"} <= set(part.kept)
    assert part.approximated == part.lost == ()
    assert part.friction.is_polynomial
    q, dq, ddq = (np.random.default_rng(2).uniform(-1, 1, (20, 1)) for _ in range(3))
    robot = LinkFile(model.geometry, (Body(2.0, np.zeros(3), 0.01 * np.eye(3)),), (part.friction,))
    smooth = replace(robot, friction=(replace(part.friction, dry=0.0),))
    simulated = mujoco.MjModel.from_xml_string(WRITERS["xml"](smooth, "arm"))
    data = mujoco.MjData(simulated)
    torque = []
    for row in zip(q, dq, ddq, strict=True):
        data.qpos[:], data.qvel[:], data.qacc[:] = row
        mujoco.mj_inverse(simulated, data)
        dry = part.friction.dry * np.sign(row[1])
        torque.append(data.qfrc_inverse + dry - simulated.actuator_biasprm[:, 0])
    module = module_of(model)
    friction = module.torque(q.T, dq.T, ddq.T) - module.rigid_torque(q.T, dq.T, ddq.T)
    bodies = torque_of_robot(replace(robot, friction=(JointFriction(rotor=part.friction.rotor),)))
    assert np.array(torque) == pytest.approx(bodies(motion_of(q, dq, ddq)) + friction.T, rel=1e-6, abs=1e-6)
    (straight,) = joint_parts(model, "urdf", [motion_of(q, dq, ddq)], lambda motion: motion.dq)
    assert not straight.friction.is_polynomial
    assert "viscous-cubic" in straight.approximated


@pytest.mark.parametrize(("kind", "kept"), [("sdf", False), ("xml", True)])
def test_a_spring_that_pushes_away_is_lost_where_readers_refuse_it(plant, kind, kept):
    model = exported_model(identify(load_experiment(plant), "usual"))
    spring = Torque("joint-spring", 0, 0, ("q",), (-3.0,), place="stiffness")
    model = replace(model, torques=(*model.torques, spring))
    (part,) = joint_parts(model, kind, [], lambda motion: motion.q)
    assert part.friction.stiffness == (-3.0 if kept else 0.0)
    assert ("joint-spring" in part.kept) is kept
    assert ("joint-spring" in part.lost) is not kept


def test_the_command_writes_refuses_and_says_what_it_costs(plant, tmp_path):
    command = [sys.executable, "-m", "api", "export", str(plant)]
    done = subprocess.run(
        [*command, str(tmp_path / "arm.urdf"), "--json"], capture_output=True, text=True, check=True
    )
    assert json.loads(done.stdout)["joints"][0]["kept"] == ["rigid body", "viscous", "coulomb"]
    assert json.loads((tmp_path / "arm.urdf.certificate.json").read_text()) == json.loads(done.stdout)
    for target, said in (("arm.stl", ".urdf"), ("nowhere/arm.c", "no folder")):
        wrong = subprocess.run(
            [*command, str(tmp_path / target)], capture_output=True, text=True, check=False
        )
        assert wrong.returncode == 2
        assert said in wrong.stderr
        assert wrong.stderr.count("\n") == 1
    assert sorted(path.name for path in tmp_path.iterdir()) == ["arm.urdf", "arm.urdf.certificate.json"]
