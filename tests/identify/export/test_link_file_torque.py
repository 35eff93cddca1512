"""URDF, SDF and MJCF files say to our own reader of robots, to Pinocchio and to MuJoCo what was written."""

from __future__ import annotations

import re
import tempfile
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st

from identify.dynamics.geometry import NOMINAL_ANGLE_TOLERANCE, Geometry
from identify.dynamics.rotations import roll_pitch_yaw
from identify.dynamics.urdf import read_urdf
from identify.export import link_file_torque
from identify.export.link_file_torque import (
    ProgramRefuses,
    arm_torque,
    arm_torque_by_own_reader,
    arm_torque_by_program,
    program_here,
)
from identify.export.link_files import WRITERS, Body, JointFriction, LinkFile, SharedMotor, frame
from identify.recording import InputError
from tests.identify.dynamics.random_robots import random_motion, robots
from tests.identify.dynamics.random_robots import robot as described
from tests.identify.export.described_robot import torque_of_robot
from tests.identify.export.test_link_files import motion_of, random_link_file

TWISTED_BY_THE_TOLERANCE = described(
    (0.0, 0.0, -9.81),
    [("revolute", 0.0, 0.0, 0.0, 0.0), ("revolute", NOMINAL_ANGLE_TOLERANCE, 0.0, 0.0, 0.0)],
)
"""its axes' sine is less than the tolerance by 1e-15: the reader takes them for parallel, `Geometry` does not"""


def taken_for_right(geometry: Geometry, file: Path) -> bool:
    """Whether an angle is a right one but for some 1e-5, in the file or between the axes: the reader takes it for the right
    one, and at the tolerance itself rounding decides.
    """
    stated = [roll_pitch_yaw(frame(geometry, joint)[1]) for joint in range(geometry.joint_count)]
    read = [(joint.alpha, joint.theta) for joint in read_urdf(file).robot.joints]
    angles = np.concatenate([geometry.alpha, np.ravel(stated), np.ravel(read)])
    beside = np.abs(angles - np.round(angles / (np.pi / 2)) * (np.pi / 2))
    return bool(((beside > 1e-12) & (beside < 1.001 * NOMINAL_ANGLE_TOLERANCE)).any())


@settings(max_examples=20, deadline=None)
@given(robots, st.integers(0, 2**32 - 1), st.sampled_from(sorted(WRITERS)))
@example(description=TWISTED_BY_THE_TOLERANCE, seed=0, kind="sdf")
def test_a_file_says_to_our_own_reader_and_to_its_program_what_was_written(description, seed, kind):
    """Frames, joints, bodies, gravity and friction, from the text alone."""
    robot = random_link_file(description, seed, rotors=kind == "xml", powers=kind == "xml" and seed % 2 == 0)
    if kind == "urdf":
        friction = tuple(JointFriction(joint.damping, joint.dry) for joint in robot.friction)
        robot = replace(robot, friction=friction)
    q, dq, ddq = random_motion(seed, 4, robot.geometry.joint_count)
    with tempfile.TemporaryDirectory() as folder:
        file = Path(folder) / f"arm.{kind}"
        file.write_text(WRITERS[kind](robot, "arm"))
        gravity = np.asarray(robot.geometry.gravity) if kind == "urdf" else np.zeros(3)
        torque = arm_torque_by_own_reader(file, gravity)(q, dq, ddq)
        exact = torque_of_robot(robot)(motion_of(q, dq, ddq))
        if taken_for_right(robot.geometry, file):
            assert np.abs(torque - exact).max() < 1e-4 * np.abs(exact).max()
        else:
            assert torque == pytest.approx(exact, rel=1e-8, abs=1e-8)
        if (program := program_here(file.suffix)) is not None:
            opened, name = arm_torque_by_program(program, file, gravity)
            assert opened(q, dq, ddq) == pytest.approx(exact, rel=1e-8, abs=1e-8), name


def test_motors_that_several_joints_turn_are_read_by_us_and_by_mujoco_as_written(tmp_path):
    """Their torque written out here: on each joint what the motor gives, times how it turns with the joint."""
    arm = described(
        (0.0, 0.0, -9.81),
        [
            ("revolute", 0.0, 0.0, 0.0, 0.0),
            ("revolute", 1.2, 0.3, 0.0, 0.1),
            ("revolute", -0.4, 0.2, 0.0, 0.0),
        ],
    )
    robot = random_link_file(arm, 5)
    motors = (
        SharedMotor("first", (0.5, 1.0, 0.0), damping=0.7, dry=1.1, rotor=0.2),
        SharedMotor('second "&"', (0.0, -2.0, 1.0), damping=0.4, dry=0.3),
    )
    q, dq, ddq = random_motion(3, 6, 3)
    exact = torque_of_robot(robot)(motion_of(q, dq, ddq))
    speed, change = 0.5 * dq[:, 0] + dq[:, 1], 0.5 * ddq[:, 0] + ddq[:, 1]
    moved = 0.7 * speed + 1.1 * np.sign(speed) + 0.2 * change
    exact += np.column_stack([0.5 * moved, moved, 0.0 * moved])
    speed = dq[:, 2] - 2.0 * dq[:, 1]
    moved = 0.4 * speed + 0.3 * np.sign(speed)
    exact += np.column_stack([0.0 * moved, -2.0 * moved, moved])
    file = tmp_path / "arm.xml"
    file.write_text(WRITERS["xml"](replace(robot, motors=motors), "arm"))
    assert arm_torque_by_own_reader(file, np.zeros(3))(q, dq, ddq) == pytest.approx(exact, rel=1e-8, abs=1e-8)
    if program_here(".xml") is not None:
        opened, _ = arm_torque_by_program("mujoco", file, np.zeros(3))
        assert opened(q, dq, ddq) == pytest.approx(exact, rel=1e-8, abs=1e-8)


GRAVITY = np.array([0.0, 0.0, -9.81])


def written(folder, ending, right="", wrong=""):
    joint = SimpleNamespace(name="j", type="revolute", alpha=0.3, d=0.1, theta=0.0, r=0.2)
    geometry = Geometry.from_robot(SimpleNamespace(gravity=GRAVITY, joints=[joint]))
    robot = LinkFile(geometry, (Body(2.0, np.zeros(3), 0.01 * np.eye(3)),), (JointFriction(1.0, 3.0),))
    text = WRITERS[ending](robot, "arm")
    assert right in text
    file = folder / f"arm.{ending}"
    file.write_text(text.replace(right, wrong) if right else text)
    return file


@pytest.mark.parametrize(
    ("ending", "right", "wrong", "said"),
    [
        ("xml", 'type="hinge"', 'type="hing"', "MuJoCo .* does not take the file: .*"),
        ("urdf", 'child link="link1"', 'child link=""', "Pinocchio .* does not take the file: .*"),
    ],
)
def test_what_the_program_says_of_a_file_that_it_does_not_take_is_one_line(
    tmp_path, ending, right, wrong, said
):
    with pytest.raises(ProgramRefuses) as refused:
        arm_torque(written(tmp_path, ending, right, wrong), GRAVITY)
    assert re.fullmatch(said, str(refused.value))


@pytest.mark.parametrize("ending", sorted(WRITERS))
def test_who_read_the_file_is_said(tmp_path, monkeypatch, ending):
    torque, by = arm_torque(written(tmp_path, ending), GRAVITY)
    names = {
        "urdf": "opened by Pinocchio",
        "xml": "opened by MuJoCo",
        "sdf": "coulomb's own reader of robots",
    }
    assert names[ending] in by
    monkeypatch.setattr(link_file_torque, "program_here", lambda suffix: None)
    ours, by = arm_torque(written(tmp_path, ending), GRAVITY)
    assert "coulomb's own reader of robots" in by
    assert ("was not installed to open it" in by) is (ending != "sdf")
    motion = (np.array([[0.4]]), np.array([[0.2]]), np.array([[-1.0]]))
    assert ours(*motion) == pytest.approx(torque(*motion), rel=1e-9)


def test_a_text_that_is_no_xml_is_refused_with_the_file_s_name(tmp_path):
    (tmp_path / "arm.sdf").write_text("<sdf")
    with pytest.raises(InputError, match=r"^arm\.sdf: is not XML: "):
        arm_torque(tmp_path / "arm.sdf", GRAVITY)


def test_mujoco_opens_the_urdf_and_finds_the_same_torques(tmp_path):
    """Dry friction apart, which MuJoCo has as a constraint; it leaves out the gravity that a URDF does not state."""
    mujoco = pytest.importorskip("mujoco", reason="MuJoCo is not installed")
    file = written(tmp_path, "urdf", 'friction="3.0"', 'friction="0.0"')
    model = mujoco.MjModel.from_xml_path(str(file))
    model.opt.gravity[:] = GRAVITY
    data = mujoco.MjData(model)
    data.qpos[:], data.qvel[:], data.qacc[:] = 0.4, 0.2, -1.0
    mujoco.mj_inverse(model, data)
    exact = arm_torque_by_own_reader(file, GRAVITY)(np.array([[0.4]]), np.array([[0.2]]), np.array([[-1.0]]))
    assert data.qfrc_inverse == pytest.approx(exact[0], rel=1e-6)
