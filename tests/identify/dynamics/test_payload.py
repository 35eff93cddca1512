"""A payload's parameters and torque, eq. (32)-(34), against formulas written out."""

from types import SimpleNamespace

import numpy as np

from identify.dynamics.payload import payload_parameters, payload_regressor, payload_torque
from tests.identify.dynamics.random_robots import geometry_of

G = 9.81
JOINT_3 = geometry_of((0.0, -G, 0.0), [("revolute", 0.0, 0.0, 0.0, 0.0)])


def disk(mass, arm, radius=0.1, thickness=0.04):
    """The paper's disk, eq. (32): its axis is x, its centre at `arm` along x."""
    across = mass * (radius**2 / 4 + thickness**2 / 12)
    return SimpleNamespace(
        mass=mass, com=(arm, 0.0, 0.0), inertia=(mass * radius**2 / 2, 0.0, 0.0, across, 0.0, across)
    )


def test_huygens_theorem_carries_the_disk_s_inertia_to_the_joint_as_eq_33_says():
    payload = disk(6.97, 1.277)
    across = 6.97 * (0.1**2 / 4 + 0.04**2 / 12)
    moved = across + 6.97 * 1.277**2
    np.testing.assert_allclose(
        payload_parameters(payload),
        [6.97 * 0.1**2 / 2, 0, 0, moved, 0, moved, 6.97 * 1.277, 0, 0, 6.97],
    )


def test_products_of_inertia_of_a_centre_off_all_axes_have_the_minus_sign():
    point = SimpleNamespace(mass=2.0, com=(1.0, 2.0, 3.0), inertia=(0.0,) * 6)
    position = np.array([1.0, 2.0, 3.0])
    tensor = 2.0 * (position @ position * np.eye(3) - np.outer(position, position))
    expected = [*tensor[0], *tensor[1, 1:], tensor[2, 2], *(2.0 * position), 2.0]
    np.testing.assert_allclose(payload_parameters(point), expected)


def test_the_torque_of_one_joint_is_that_of_eq_34():
    q, dq, ddq = np.random.default_rng(1).uniform(-2, 2, (3, 40, 1))
    payload = disk(3.4584, 1.277)
    inertia = payload_parameters(payload)[5]
    expected = inertia * ddq + 3.4584 * 1.277 * G * np.cos(q)
    np.testing.assert_allclose(payload_torque(JOINT_3, payload, q, dq, ddq), expected, rtol=1e-12, atol=1e-12)


def test_the_regressor_times_the_parameters_is_the_torque_and_joints_can_be_asked_for_alone():
    geometry = geometry_of(
        (0.0, 0.0, -G), [("revolute", 0.3, 0.1, 0.0, 0.2), ("prismatic", -0.7, 0.2, 0.4, 0.0)]
    )
    q, dq, ddq = np.random.default_rng(2).uniform(-1, 1, (3, 25, 2))
    payload = SimpleNamespace(mass=1.5, com=(0.1, -0.2, 0.3), inertia=(0.02, 0.001, 0.0, 0.03, 0.002, 0.01))
    whole = payload_regressor(geometry, q, dq, ddq)
    assert whole.shape == (25, 2, 10)
    np.testing.assert_allclose(
        whole @ payload_parameters(payload), payload_torque(geometry, payload, q, dq, ddq), atol=1e-12
    )
    np.testing.assert_array_equal(payload_regressor(geometry, q, dq, ddq, [1])[:, 0], whole[:, 1])


def test_no_mass_makes_no_torque():
    nothing = SimpleNamespace(mass=0.0, com=(1.0, 0.0, 0.0), inertia=(0.0,) * 6)
    assert not payload_torque(JOINT_3, nothing, *np.ones((3, 4, 1))).any()
