"""Links and their inertia against integrals over points of mass and against the conservation of energy."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.integrate import solve_ivp

from drivers.simulated.plant_settings import LinkSettings
from drivers.simulated.rigid_bodies import RigidBodies, pseudo_inertia

POINTS = st.lists(st.tuples(*[st.floats(-1, 1)] * 3), min_size=2, max_size=8)
LINKS = (
    LinkSettings(alpha=0.0, d=0.1, theta=0.2, r=0.3, mass=3.0, com=(0.2, 0.1, -0.1), inertia=(0.3, 0.01, 0.02, 0.2, 0.03, 0.4)),
    LinkSettings(alpha=1.2, d=0.4, theta=-0.3, r=0.0, mass=2.0, com=(0.3, -0.1, 0.05), inertia=(0.1, 0.0, 0.01, 0.2, 0.0, 0.2)),
    LinkSettings(alpha=-0.7, d=0.2, theta=0.0, r=0.2, mass=1.0, com=(0.0, 0.1, 0.2), inertia=(0.1, 0.0, 0.0, 0.1, 0.0, 0.1)),
)  # fmt: skip
GRAVITY = (0.5, -1.0, -9.5)


@given(points=POINTS)
def test_the_pseudo_inertia_is_the_sum_over_points_of_mass(points):
    masses = np.arange(1.0, len(points) + 1)
    places = np.array(points)
    total, centre = masses.sum(), masses @ places / masses.sum()
    away = places - centre
    tensor = sum(
        m * (r @ r * np.eye(3) - np.outer(r, r)) for m, r in zip(masses, away, strict=True)
    )  # about the centre of mass
    stated = (tensor[0, 0], tensor[0, 1], tensor[0, 2], tensor[1, 1], tensor[1, 2], tensor[2, 2])
    homogeneous = np.column_stack([places, np.ones(len(points))])
    expected = (homogeneous.T * masses) @ homogeneous
    np.testing.assert_allclose(pseudo_inertia(total, tuple(centre), stated), expected, atol=1e-9)


def test_frames_stand_where_khalil_s_parameters_put_them():
    """Rot(x, α) Trans(x, d) Rot(z, θ) Trans(z, r), multiplied out."""
    q = (0.4, -0.9, 1.7)
    expected = np.eye(4)
    frames, twists = RigidBodies(LINKS, GRAVITY).frames(q)
    for number, (link, angle) in enumerate(zip(LINKS, q, strict=True)):
        ca, sa, c, s = (
            np.cos(link.alpha),
            np.sin(link.alpha),
            np.cos(angle + link.theta),
            np.sin(angle + link.theta),
        )
        tilt = np.array([[1, 0, 0, link.d], [0, ca, -sa, 0], [0, sa, ca, 0], [0, 0, 0, 1.0]])
        turn = np.array([[c, -s, 0, 0], [s, c, 0, 0], [0, 0, 1, link.r], [0, 0, 0, 1.0]])
        expected = expected @ tilt @ turn
        np.testing.assert_allclose(frames[number], expected, atol=1e-12)
        axis, origin = expected[:3, 2], expected[:3, 3]
        point = np.array([0.3, -0.2, 0.9])
        moved = twists[number] @ np.append(point, 1.0)
        np.testing.assert_allclose(moved[:3], np.cross(axis, point - origin), atol=1e-12)


@given(q=st.tuples(*[st.floats(-3, 3)] * 3), v=st.tuples(*[st.floats(-2, 2)] * 3))
def test_the_mass_matrix_is_symmetric_and_the_kinetic_energy_is_that_of_points_of_mass(q, v):
    bodies = RigidBodies(LINKS, (0.0, 0.0, 0.0))
    velocity = np.array(v)
    mass, _ = bodies.dynamics(q, velocity)
    np.testing.assert_allclose(mass, mass.T, atol=1e-12)
    assert bodies.energy(q, velocity) >= -1e-12
    frames, twists = bodies.frames(q)
    kinetic, turning = 0.0, np.zeros((4, 4))
    for number, link in enumerate(LINKS):
        turning = turning + twists[number] * velocity[number]
        rate = turning @ frames[number]
        kinetic += 0.5 * np.trace(rate @ pseudo_inertia(link.mass, link.com, link.inertia) @ rate.T)
    assert bodies.energy(q, velocity) == pytest.approx(kinetic, abs=1e-9)


def test_without_torque_the_energy_stays():
    bodies = RigidBodies(LINKS, GRAVITY, pseudo_inertia(2.0, (0.1, 0.2, 0.3), (0.1, 0, 0, 0.1, 0, 0.1)))

    def rates(_, state):
        mass, bias = bodies.dynamics(state[:3], state[3:])
        return np.concatenate([state[3:], np.linalg.solve(mass, -bias)])

    start = np.array([0.3, -0.4, 0.8, 0.5, -0.2, 1.0])
    end = solve_ivp(rates, (0.0, 2.0), start, rtol=1e-9, atol=1e-10).y[:, -1]
    assert np.abs(end - start).max() > 0.5
    assert bodies.energy(end[:3], end[3:]) == pytest.approx(bodies.energy(start[:3], start[3:]), abs=1e-5)


def test_a_payload_adds_its_mass_to_the_last_link():
    without, with_it = (
        RigidBodies(LINKS, GRAVITY),
        RigidBodies(LINKS, GRAVITY, pseudo_inertia(4.0, (0, 0, 0), (0,) * 6)),
    )
    q, rest = (0.1, 0.2, 0.3), np.zeros(3)
    height = np.array(without.frames(q)[0][-1][:3, 3]) @ np.array(GRAVITY)
    assert with_it.energy(q, rest) - without.energy(q, rest) == pytest.approx(-4.0 * height)
