"""The recursive Newton-Euler algorithm against the regressor and against Pinocchio."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from identify.dynamics.geometry import Geometry
from identify.dynamics.inverse_dynamics import InverseDynamics
from tests.identify.dynamics.random_robots import pinocchio_regressor, random_motion, robots


@settings(max_examples=25, deadline=None)
@given(robots, st.integers(0, 2**32 - 1))
def test_torques_are_pinocchio_s_for_any_robot_and_any_parameters(description, seed):
    geometry = Geometry.from_robot(description)
    n = geometry.joint_count
    random = np.random.default_rng(seed)
    standard = random.uniform(-2, 2, (2, 11 * n))
    standard[:, 10::11] = 0.0  # rotor inertias, which Pinocchio's regressor does not have
    q, dq, ddq = random_motion(seed, 5, n)
    regressor = pinocchio_regressor(geometry, q, dq, ddq)
    links = np.delete(standard, np.arange(10, 11 * n, 11), axis=1)
    for found, own in zip(InverseDynamics(geometry, list(standard)).torques(q, dq, ddq), links, strict=True):
        assert found == pytest.approx(regressor @ own, rel=1e-9, abs=1e-8)


def test_a_rotor_is_felt_on_its_own_joint_alone():
    geometry = Geometry(
        np.zeros(3),
        np.zeros(2),
        np.array([0.0, 0.5]),
        np.zeros(2),
        np.zeros(2),
        np.zeros(2, bool),
        ("a", "b"),
    )
    standard = np.zeros(22)
    standard[[10, 21]] = 0.3, 0.7
    ddq = np.array([[1.0, -2.0]])
    (torque,) = InverseDynamics(geometry, [standard]).torques(np.zeros((1, 2)), np.zeros((1, 2)), ddq)
    assert torque == pytest.approx(np.array([[0.3, -1.4]]))
