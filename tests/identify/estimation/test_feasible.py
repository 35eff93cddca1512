"""Feasible parameters: every link a body with mass, and no farther from the estimate than need be."""

from __future__ import annotations

import numpy as np
import pytest

from identify.dynamics.base_parameters import base_parameters
from identify.dynamics.standard_parameters import PARAMETERS_PER_JOINT
from tests.identify.dynamics.random_robots import geometry_of

pytest.importorskip("cvxpy", reason="the extra 'feasible' is not installed")

from identify.estimation.feasible import nearest_feasible, pseudo_inertia

BASE = base_parameters(
    geometry_of(
        (0.0, 0.0, -9.81),
        [
            ("revolute", 0.0, 0.0, 0.0, 0.3),
            ("revolute", -1.5707963, 0.1, 0.0, 0.0),
            ("prismatic", 1.5707963, 0.4, 0.2, 0.0),
        ],
    )
)


def body(random):
    """XX … M of a cloud of point masses: a real body, whatever comes of it."""
    masses = random.uniform(0.1, 2.0, 12)
    points = random.uniform(-0.3, 0.3, 3) + random.normal(0.0, 0.1, (12, 3))
    second = (masses[:, None] * points).T @ points
    inertia = np.trace(second) * np.eye(3) - second
    upper = inertia[np.triu_indices(3)]
    return np.concatenate([upper, masses @ points, [masses.sum()]])


def robot(random):
    """(11 n,) standard parameters of a real robot."""
    return np.concatenate([np.append(body(random), random.uniform(0.01, 0.5)) for _ in range(3)])


def information(random):
    W = random.standard_normal((200, len(BASE))) * 10.0 ** random.uniform(-1, 1, len(BASE))
    return W.T @ W


def assert_real(standard):
    for link in standard.reshape(-1, PARAMETERS_PER_JOINT):
        assert np.linalg.eigvalsh(pseudo_inertia(link)).min() > 0
        assert link[-1] >= -1e-9


@pytest.mark.parametrize("seed", range(3))
def test_an_estimate_that_is_feasible_stays(seed):
    random = np.random.default_rng(seed)
    truth = BASE.from_standard(robot(random))
    found = nearest_feasible(BASE, truth, information(random))
    assert_real(found.standard)
    np.testing.assert_allclose(found.base, truth, atol=2e-4)


@pytest.mark.parametrize("seed", range(3))
def test_an_infeasible_estimate_becomes_feasible_and_no_farther_than_the_truth(seed):
    random = np.random.default_rng(10 + seed)
    truth = BASE.from_standard(robot(random))
    metric = information(random)
    estimate = truth.copy()
    estimate[0] = -0.5  # the inertia of the first joint
    found = nearest_feasible(BASE, estimate, metric)
    assert_real(found.standard)
    of_truth = np.sqrt((truth - estimate) @ metric @ (truth - estimate))
    assert found.distance <= of_truth * (1 + 1e-6)
    assert found.base[0] > 0


def test_bodies_without_rotors_are_found_where_a_format_has_none():
    random = np.random.default_rng(20)
    bodies = robot(random)
    bodies[PARAMETERS_PER_JOINT - 1 :: PARAMETERS_PER_JOINT] = 0.0
    truth = BASE.from_standard(bodies)
    found = nearest_feasible(BASE, truth, information(random), rotors=False)
    assert_real(found.standard)
    rotors = found.standard[PARAMETERS_PER_JOINT - 1 :: PARAMETERS_PER_JOINT]
    np.testing.assert_allclose(rotors, 0.0, atol=1e-9)
    np.testing.assert_allclose(found.base, truth, atol=2e-4)


def test_the_pseudo_inertia_of_a_cloud_of_points_is_its_second_moment():
    random = np.random.default_rng(4)
    masses, points = random.uniform(0.1, 1.0, 7), random.standard_normal((7, 3))
    second = (masses[:, None] * points).T @ points
    inertia = np.trace(second) * np.eye(3) - second
    link = np.concatenate([inertia[np.triu_indices(3)], masses @ points, [masses.sum()]])
    homogeneous = np.column_stack([points, np.ones(7)])
    expected = (masses[:, None] * homogeneous).T @ homogeneous
    np.testing.assert_allclose(pseudo_inertia(link), expected, atol=1e-12)


@pytest.mark.parametrize(("mass", "length"), [(1e-9, 0.02), (1e8, 50.0)])
def test_a_watch_and_a_crane_of_the_same_shape_have_bodies_of_the_same_shape(mass, length):
    """Mass and length scaled, the problem is the same, and so is what is found, feasible at the start or not."""
    random = np.random.default_rng(5)
    other = base_parameters(
        geometry_of(
            (0.0, 0.0, -9.81),
            [
                ("revolute", 0.0, 0.0, 0.0, 0.3 * length),
                ("revolute", -1.5707963, 0.1 * length, 0.0, 0.0),
                ("prismatic", 1.5707963, 0.4 * length, 0.2, 0.0),
            ],
        )
    )
    assert other.names == BASE.names
    estimate, metric = BASE.from_standard(robot(random)), information(random)
    estimate[0] = -0.5
    powers = np.array([{"kg": 0, "kg m": 1, "kg m^2": 2}[unit] for unit in BASE.units])
    unit = mass * length**powers
    found = nearest_feasible(BASE, estimate, metric)
    scaled = nearest_feasible(other, estimate * unit, metric / np.outer(unit, unit))
    for link in scaled.standard.reshape(-1, PARAMETERS_PER_JOINT):
        assert np.linalg.eigvalsh(pseudo_inertia(link)).min() > 0
    np.testing.assert_allclose(scaled.base / unit, found.base, atol=1e-3)
    assert scaled.distance == pytest.approx(found.distance, rel=1e-3)
