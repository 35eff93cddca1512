"""The rigid robot as the estimator uses it, against a pendulum and a slide whose torques are written out."""

from __future__ import annotations

import numpy as np
import pytest

from identify.dynamics.base_parameters import base_parameters
from identify.estimation.rigid_body import RigidBody, across
from identify.recording import Payload
from tests.identify.dynamics.random_robots import geometry_of

G = 9.81
BARE = Payload(name="none", mass=0.0)
DISK = Payload(name="disk", mass=0.4, com=(0.7, -0.1, 0.0), inertia=(0.0, 0.0, 0.0, 0.0, 0.0, 0.05))
DISK_ABOUT_JOINT = 0.05 + 0.4 * (0.7**2 + 0.1**2)
CHI = {"ZZ1R": 2.5, "MX1": 1.2, "MY1": -0.3}


@pytest.fixture(scope="module")
def pendulum() -> RigidBody:
    """One joint about a level axis: tau = ZZ ddq + g (MX cos q - MY sin q)."""
    geometry = geometry_of((0.0, -G, 0.0), [("revolute", 0.0, 0.0, 0.0, 0.0)])
    return RigidBody(base_parameters(geometry), (BARE, DISK), np.array([[3.0]]))


@pytest.fixture(scope="module")
def motion() -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    q, dq, ddq = np.random.default_rng(3).uniform(-2.0, 2.0, (3, 30, 1))
    return q, dq, ddq


def chi(body: RigidBody) -> np.ndarray:
    assert set(body.base.names) == set(CHI)
    return np.array([CHI[name] for name in body.base.names])


def of_the_disk(q: np.ndarray, ddq: np.ndarray) -> np.ndarray:
    return DISK_ABOUT_JOINT * ddq + 0.4 * G * (0.7 * np.cos(q) + 0.1 * np.sin(q))


def test_a_light_payload_and_an_external_force_are_known_loads(pendulum, motion):
    q, dq, ddq = motion
    np.testing.assert_allclose(pendulum.known_load(DISK, q, dq, ddq, None), of_the_disk(q, ddq), rtol=1e-12)
    pushed = np.full(q.shape, 2.0)
    np.testing.assert_allclose(
        pendulum.known_load(DISK, q, dq, ddq, pushed), of_the_disk(q, ddq) - 2.0, rtol=1e-12
    )
    assert not pendulum.known_load(BARE, q, dq, ddq, None).any()
    point = Payload(name="screw", mass=0.02, com=(0.7, 0.0, 0.0))
    torque = 0.02 * (0.7**2 * ddq + 0.7 * G * np.cos(q))
    np.testing.assert_allclose(pendulum.known_load(point, q, dq, ddq, None), torque, rtol=1e-12)


def test_a_payload_may_have_an_inertia_and_next_to_no_mass(pendulum, motion):
    q, dq, ddq = motion
    wheel = Payload(name="wheel", mass=0.0, inertia=(0.0, 0.0, 0.0, 0.0, 0.0, 0.05))
    np.testing.assert_allclose(pendulum.known_load(wheel, q, dq, ddq, None), 0.05 * ddq, rtol=1e-12)


def test_the_load_is_that_of_the_base_parameters_beside_what_is_known(pendulum, motion):
    q, dq, ddq = motion
    columns, known = pendulum.inertial_columns(q, dq, ddq), of_the_disk(q, ddq)
    arm = 2.5 * ddq + G * (1.2 * np.cos(q) + 0.3 * np.sin(q))
    np.testing.assert_allclose(pendulum.load(columns, chi(pendulum), known), arm + known, rtol=1e-12)


def test_the_slope_of_the_load_is_its_derivative_over_the_position(pendulum, motion):
    q, dq, ddq = motion
    slope = pendulum.slope_columns(0, DISK, q, dq, ddq).at(chi(pendulum))
    exact = G * (-1.2 * np.sin(q) + 0.3 * np.cos(q)) + 0.4 * G * (-0.7 * np.sin(q) + 0.1 * np.cos(q))
    np.testing.assert_allclose(slope, exact[:, 0], rtol=1e-7, atol=1e-7)


def test_the_inertia_is_the_torque_per_acceleration(pendulum, motion):
    np.testing.assert_allclose(
        pendulum.inertia_columns(0, motion[0]).at(chi(pendulum)), 2.5, rtol=1e-12, atol=1e-12
    )


def test_gravity_across_the_declared_one_turns_the_pendulum_s_weight_by_a_right_angle(pendulum, motion):
    q = motion[0]
    gradient = np.column_stack([each.at(chi(pendulum)) for each in pendulum.gravity_columns(0, DISK, q)])
    moment_x, moment_y = 1.2 + 0.4 * 0.7, -0.3 - 0.4 * 0.1
    # tau = -(gravity turned into the link) x moment: of gravity along x of the base, MX sin q + MY cos q
    along_x = moment_x * np.sin(q[:, 0]) + moment_y * np.cos(q[:, 0])
    directions = np.array(across(np.array([0.0, -G, 0.0])))
    np.testing.assert_allclose(gradient, np.outer(along_x, directions[:, 0]), atol=1e-12)


def test_the_gradient_over_a_payload_s_centre_is_the_derivative_written_out(pendulum, motion):
    q, dq, ddq = motion
    gradient = pendulum.payload_gradient(0, DISK, q, dq, ddq)
    along_x = 0.4 * (2 * 0.7 * ddq + G * np.cos(q))
    along_y = 0.4 * (2 * -0.1 * ddq - G * np.sin(q))
    np.testing.assert_allclose(
        gradient, np.hstack([along_x, along_y, np.zeros_like(q)]), rtol=1e-7, atol=1e-7
    )


@pytest.mark.parametrize(
    ("gravity", "kind", "along"),
    [
        ((0.0, 0.0, -G), "revolute", True),  # a vertical axis
        ((0.0, -G, 0.0), "revolute", False),
        ((0.0, -G, 0.0), "prismatic", True),  # a level slide
        ((0.0, 0.0, -G), "prismatic", False),
    ],
)
def test_gravity_makes_no_torque_about_a_vertical_axis_and_no_force_along_a_level_slide(gravity, kind, along):
    body = RigidBody(base_parameters(geometry_of(gravity, [(kind, 0.0, 0.0, 0.0, 0.0)])), (BARE,), np.eye(1))
    assert body.axis_along_gravity(0) is along


@pytest.mark.parametrize("gravity", [(0.0, 0.0, -G), (3.0, -4.0, 5.0), (0.0, 2.0, 0.0)])
def test_the_directions_across_are_a_right_handed_frame_with_gravity(gravity):
    first, second = across(np.array(gravity))
    down = np.array(gravity) / np.linalg.norm(gravity)
    np.testing.assert_allclose(np.linalg.det(np.array([down, first, second])), 1.0, rtol=1e-12)
    frame = np.array([down, first, second])
    np.testing.assert_allclose(frame @ frame.T, np.eye(3), atol=1e-12)


def test_without_gravity_the_directions_across_are_two_axes_of_the_base():
    np.testing.assert_array_equal(across(np.zeros(3)), np.eye(3)[:2])


def test_payloads_are_numbered_as_the_experiment_lists_them(pendulum):
    assert [pendulum.payload_index(payload) for payload in (BARE, DISK)] == [0, 1]
    assert pendulum.joints == 1
    assert pendulum.shared_motors == ()


def several(kinds: list[str], gain: np.ndarray, ratios: tuple[float, ...] = ()) -> RigidBody:
    geometry = geometry_of((0.0, -G, 0.0), [(kind, 0.3, 0.2, 0.0, 0.0) for kind in kinds])
    return RigidBody(base_parameters(geometry), (BARE,), gain, ratios)


def test_a_motor_that_two_joints_turn_does_so_by_the_ratio_of_their_gears():
    body = several(["revolute"] * 3, np.eye(3), (80.0, 100.0, -50.0))
    np.testing.assert_array_equal(body.pair_turns(1, 1.0), [0.8, 1.0, 0.0])
    np.testing.assert_array_equal(body.pair_turns(2, -1.0), [0.0, 2.0, 1.0])
    np.testing.assert_array_equal(several(["revolute"] * 2, np.eye(2)).pair_turns(1, -1.0), [-1.0, 1.0])


def test_only_neighbours_of_one_kind_whose_gains_say_nothing_of_it_may_share_a_motor_undeclared():
    wrist = np.array([[2.0, 0.0, 0.0], [0.0, 2.0, 1.0], [0.0, 0.0, 2.0]])
    assert [several(["revolute"] * 3, wrist).may_share_undeclared(joint) for joint in range(3)] == [
        False,
        True,
        False,
    ]
    scara = several(["revolute", "revolute", "prismatic"], np.eye(3))
    assert [scara.may_share_undeclared(joint) for joint in range(3)] == [False, True, False]
