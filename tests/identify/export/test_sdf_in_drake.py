"""The SDF file opened by libsdformat, Gazebo's own reader, inside Drake, which computes its torques."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from identify.export.link_files import WRITERS, joints_renamed, sdf_joint_names
from tests.identify.dynamics.random_robots import random_motion, robots
from tests.identify.export.described_robot import torque_of_robot
from tests.identify.export.test_link_files import motion_of, random_link_file

pytest.importorskip("pydrake", reason="Drake is not installed; it has no wheel for Windows")

from pydrake.multibody.parsing import Parser
from pydrake.multibody.plant import MultibodyPlant
from pydrake.multibody.tree import MultibodyForces


def in_drake(text, gravity):
    """The robot of an SDF text; Drake reads no gravity of a world, and takes the robot's."""
    plant = MultibodyPlant(0.0)
    Parser(plant).AddModelsFromString(text, "sdf")
    plant.mutable_gravity_field().set_gravity_vector(np.asarray(gravity, float))
    plant.Finalize()
    return plant


@settings(max_examples=15, deadline=None)
@given(robots, st.integers(0, 2**32 - 1))
def test_drake_reads_the_sdf_and_finds_the_same_torques(description, seed):
    """Bodies, frames, damping and springs; dry friction is in the file, and Drake has no model of it."""
    robot = random_link_file(description, seed, rotors=False)
    plant = in_drake(WRITERS["sdf"](robot, "arm"), robot.geometry.gravity)
    context = plant.CreateDefaultContext()
    q, dq, ddq = random_motion(seed, 4, robot.geometry.joint_count)
    found = []
    for row in range(4):
        plant.SetPositions(context, q[row])
        plant.SetVelocities(context, dq[row])
        forces = MultibodyForces(plant)
        plant.CalcForceElementsContribution(context, forces)
        found.append(plant.CalcInverseDynamics(context, ddq[row], forces))
    dry = np.array([own.dry for own in robot.friction]) * np.sign(dq)
    exact = torque_of_robot(robot)(motion_of(q, dq, ddq))
    assert np.array(found) + dry == pytest.approx(exact, rel=1e-6, abs=1e-6)


ODD = (
    "base",
    "link1",
    "link2",
    "link1_",
    "to_the_world",
    "world",
    "world_joint",
    "__x__",
    "a::b",
    "a:b",
    " a:b",
    ":::",
    "für <z>",
)
"""what SDF keeps for itself, what the file's own links and joints would be called, and what becomes alike when it is changed"""


@settings(max_examples=15, deadline=None)
@given(robots, st.permutations(ODD))
def test_drake_reads_the_sdf_of_joints_with_any_names_and_what_is_renamed_is_said(description, names):
    robot = random_link_file(description, 3, rotors=False)
    names = tuple(names[: robot.geometry.joint_count])
    robot = replace(robot, geometry=replace(robot.geometry, names=names))
    plant = in_drake(WRITERS["sdf"](robot, "arm"), robot.geometry.gravity)
    written = sdf_joint_names(names)
    assert plant.num_velocities() == len(set(written)) == len(names)
    for place, name in enumerate(written):
        assert plant.GetJointByName(name).velocity_start() == place
    changed = [(name, allowed) for name, allowed in zip(names, written, strict=True) if name != allowed]
    assert {name for name, _ in changed} <= {"world", "__x__", "a::b", " a:b", ":::"}
    said = joints_renamed(names)
    assert len(said) == len(changed)
    for (name, allowed), remark in zip(changed, said, strict=True):
        assert repr(name) in remark
        assert repr(allowed) in remark
