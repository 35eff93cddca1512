"""The regressor, the number of base parameters and payload torques against Pinocchio, on random robots."""

from __future__ import annotations

from types import SimpleNamespace

import numpy as np
import pinocchio as pin
from hypothesis import example, given, settings
from hypothesis import strategies as st

from identify.dynamics.base_parameters import DEPENDENCE_TOLERANCE, base_parameters
from identify.dynamics.geometry import Geometry
from identify.dynamics.payload import payload_parameters, payload_regressor, payload_torque
from identify.dynamics.regressor import BLOCK_SAMPLES, standard_regressor
from identify.recording import load_experiment
from tests.identify.dynamics import random_robots
from tests.identify.dynamics.random_robots import (
    geometry_of,
    link_columns,
    pinocchio_model,
    pinocchio_regressor,
    random_motion,
    robots,
)

seeds = st.integers(0, 2**32 - 1)


def largest_difference(ours, reference):
    return np.abs(ours - reference).max() / max(np.abs(reference).max(), 1e-300)


@settings(max_examples=60, deadline=None)
@given(robots, seeds)
def test_every_element_of_the_regressor_is_pinocchios(robot, seed):
    geometry = Geometry.from_robot(robot)
    motion = random_motion(seed, 5, geometry.joint_count)
    assert (
        largest_difference(
            link_columns(standard_regressor(geometry, *motion)), pinocchio_regressor(geometry, *motion)
        )
        < 1e-9
    )


@settings(max_examples=25, deadline=None)
@given(robots, seeds)
def test_the_base_parameters_are_as_many_as_a_reduction_of_pinocchios_regressor_gives(robot, seed):
    geometry = Geometry.from_robot(robot)
    assert len(base_parameters(geometry)) == pinocchios_count(geometry, seed)


def test_the_tx40_has_as_many_base_parameters_as_a_reduction_of_pinocchios_regressor_gives(tx40):
    geometry = Geometry.from_robot(load_experiment(tx40).robot)
    assert len(base_parameters(geometry)) == pinocchios_count(geometry, 40)


def pinocchios_count(geometry, seed):
    """Rank of Pinocchio's regressor with a rotor on every joint, over random motion."""
    n = geometry.joint_count
    q, dq, ddq = random_motion(seed, 40 * n, n)
    rotors = np.einsum("ki,ij->kij", ddq, np.eye(n))
    observed = np.concatenate([pinocchio_regressor(geometry, q, dq, ddq), rotors], axis=2).reshape(-1, 11 * n)
    lengths = np.linalg.norm(observed, axis=0)
    observed = observed[:, lengths > 1e-9 * lengths.max()]
    singular = np.linalg.svd(observed / np.linalg.norm(observed, axis=0), compute_uv=False)
    return np.count_nonzero(singular > 1e-9 * singular[0])


@settings(max_examples=25, deadline=None)
@given(robots, seeds)
# Half a degree from a right angle thrice: what a column is on its own is 2e-9 of it, so that it counts as dependent.
@example(
    random_robots.robot(
        (0.0, 0.0, -9.81),
        [("revolute", angle, 0.0, 0.0, 0.0) for angle in (0.0, 0.0, 0.0, np.pi / 2, 1.5625, 1.5625)],
    ),
    0,
)
def test_base_parameters_give_the_torques_of_the_standard_parameters(robot, seed):
    """To the part of a column below which it counts as dependent on others, and is left out."""
    geometry = Geometry.from_robot(robot)
    base = base_parameters(geometry)
    motion = random_motion(seed, 7, geometry.joint_count)
    standard = np.random.default_rng(seed).normal(size=11 * geometry.joint_count)
    regressor = standard_regressor(geometry, *motion)
    torque = regressor @ standard
    left_out = DEPENDENCE_TOLERANCE * (np.abs(regressor) @ np.abs(standard)).max()
    np.testing.assert_allclose(
        base.columns(*motion) @ base.from_standard(standard), torque, rtol=0, atol=left_out
    )
    for joint in range(geometry.joint_count):
        ours = base.joint_columns(joint, *motion) @ base.from_standard(standard)[base.acts_on(joint)]
        np.testing.assert_allclose(ours, torque[:, joint], rtol=0, atol=left_out)


@settings(max_examples=25, deadline=None)
@given(robots, seeds)
def test_a_payload_makes_the_torque_that_pinocchio_computes_for_a_body_on_the_last_link(robot, seed):
    geometry = Geometry.from_robot(robot)
    n = geometry.joint_count
    generator = np.random.default_rng(seed)
    mass, com = generator.uniform(0.1, 10.0), generator.uniform(-1.0, 1.0, 3)
    root = generator.normal(size=(3, 3))
    inertia = root @ root.T
    xx, xy, xz, yy, yz, zz = inertia[np.triu_indices(3)]
    payload = SimpleNamespace(mass=mass, com=com, inertia=[xx, xy, xz, yy, yz, zz])
    model = pinocchio_model(geometry)
    model.inertias[n] = pin.Inertia(mass, com, inertia)
    q, dq, ddq = random_motion(seed, 5, n)
    data = model.createData()
    reference = np.array([pin.rnea(model, data, *sample) for sample in zip(q, dq, ddq, strict=True)])
    assert largest_difference(payload_torque(geometry, payload, q, dq, ddq), reference) < 1e-9
    assert (
        largest_difference(payload_regressor(geometry, q, dq, ddq) @ payload_parameters(payload), reference)
        < 1e-9
    )


def test_blocks_of_samples_join_without_a_seam():
    six_joints = geometry_of((0.0, 0.0, -9.81), [("revolute", k - 1.0, 0.1 * k, 0.0, 0.2) for k in range(6)])
    motion = random_motion(1, 2 * BLOCK_SAMPLES + 3, 6)
    whole = standard_regressor(six_joints, *motion)
    end = standard_regressor(six_joints, *(array[-5:] for array in motion))
    assert np.array_equal(whole[-5:], end)
