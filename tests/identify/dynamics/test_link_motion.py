"""The motion of every link against 4x4 transforms that are differentiated numerically, and its wrench against Newton-Euler."""

from __future__ import annotations

import numpy as np
import pytest

from identify.dynamics.geometry import Geometry
from identify.dynamics.link_motion import link_motions
from identify.dynamics.standard_parameters import STANDARD_PARAMETERS

ARM = Geometry(
    gravity=np.array([0.4, -1.2, -9.7]),
    alpha=np.array([0.3, -1.1, 0.7, 1.4]),
    d=np.array([0.2, 0.35, -0.15, 0.1]),
    theta=np.array([0.1, -0.4, 0.9, 0.2]),
    r=np.array([0.25, -0.1, 0.3, 0.15]),
    prismatic=np.array([False, True, False, False]),
    names=("a", "b", "c", "d"),
)
Q = np.array([0.4, 0.3, -0.8, 1.1])
DQ = np.array([1.3, -0.7, 0.9, -1.6])
DDQ = np.array([-2.1, 1.9, 3.2, 0.8])
STEP = 1e-4
"""s, of the central differences: their error is some 1e-7 of the values here"""


def transforms(q):
    """Frame of each link in the base: Rot(x, alpha) Trans(x, d) Rot(z, theta) Trans(z, r), multiplied out."""
    whole, frames = np.eye(4), []
    for j in range(4):
        theta = ARM.theta[j] + (0 if ARM.prismatic[j] else q[j])
        r = ARM.r[j] + (q[j] if ARM.prismatic[j] else 0)
        (ca, sa), (ct, st) = ((np.cos(angle), np.sin(angle)) for angle in (ARM.alpha[j], theta))
        about_x = np.array([[1, 0, 0, ARM.d[j]], [0, ca, -sa, 0], [0, sa, ca, 0], [0, 0, 0, 1]])
        about_z = np.array([[ct, -st, 0, 0], [st, ct, 0, 0], [0, 0, 1, r], [0, 0, 0, 1]])
        whole = whole @ about_x @ about_z
        frames.append(whole)
    return np.array(frames)


def vee(skew):
    return np.array([skew[2, 1], skew[0, 2], skew[1, 0]])


def at(time):
    return transforms(Q + DQ * time + DDQ * time**2 / 2)


def moved(j):
    """Rotation, angular velocity and acceleration, and acceleration of the origin, of link j: in its own frame."""
    before, now, after = (at(time)[j] for time in (-STEP, 0.0, STEP))
    rotation = now[:3, :3]
    rate = (after - before)[:3, :3] / (2 * STEP)
    change = (after - 2 * now + before)[:3, :3] / STEP**2
    gyration = rotation.T @ change  # R'' = R U, U = [w']x + [w]x [w]x
    acceleration = rotation.T @ ((after - 2 * now + before)[:3, 3] / STEP**2 - ARM.gravity)
    return vee(rotation.T @ rate), vee((gyration - gyration.T) / 2), gyration, acceleration


def vector(components):
    return np.array([float(np.asarray(each).ravel()[0]) for each in components])


MOTIONS = list(link_motions(ARM, Q[:, None], DQ[:, None], DDQ[:, None], last_link=3))


@pytest.mark.parametrize("j", range(4))
def test_a_link_moves_as_its_transform_does(j):
    velocity, turning, gyration, acceleration = moved(j)
    motion, near = MOTIONS[j], {"rel": 1e-5, "abs": 1e-5}
    assert motion.index == j
    assert vector(motion.angular_acceleration) == pytest.approx(turning, **near)
    columns = np.array([vector(column) for column in motion.gyration]).T
    assert columns == pytest.approx(gyration, **near)
    assert vector(motion.acceleration) == pytest.approx(acceleration, **near)
    x, y, z = velocity
    assert vector(motion.products) == pytest.approx([y * z, x * z, x * y], **near)


@pytest.mark.parametrize("j", range(4))
def test_each_joint_turns_and_carries_the_links_beyond_it(j):
    rotation = transforms(Q)[j][:3, :3]
    assert len(MOTIONS[j].rotations) == len(MOTIONS[j].translations) == j + 1
    for i, (turned, carried) in enumerate(zip(MOTIONS[j].rotations, MOTIONS[j].translations, strict=True)):
        step = np.eye(4)[i] * 1e-6
        change = (transforms(Q + step)[j] - transforms(Q - step)[j]) / 2e-6
        assert vector(carried) == pytest.approx(rotation.T @ change[:3, 3], abs=1e-8)
        axis = vee(rotation.T @ change[:3, :3])
        assert (turned is None) == bool(ARM.prismatic[i])
        assert (np.zeros(3) if turned is None else vector(turned)) == pytest.approx(axis, abs=1e-8)


@pytest.mark.parametrize("j", range(4))
def test_a_body_s_wrench_is_newtons_and_eulers(j):
    mass, com = 3.0, np.array([0.11, -0.07, 0.2])
    central = np.array([[0.2, 0.03, -0.02], [0.03, 0.3, 0.05], [-0.02, 0.05, 0.25]])
    about_origin = central + mass * (com @ com * np.eye(3) - np.outer(com, com))
    body = {
        "XX": about_origin[0, 0],
        "XY": about_origin[0, 1],
        "XZ": about_origin[0, 2],
        "YY": about_origin[1, 1],
        "YZ": about_origin[1, 2],
        "ZZ": about_origin[2, 2],
        "MX": mass * com[0],
        "MY": mass * com[1],
        "MZ": mass * com[2],
        "M": mass,
        "Ia": 5.0,
    }
    velocity, turning, gyration, acceleration = moved(j)
    force, moment = np.zeros(3), np.zeros(3)
    for number, symbol in enumerate(STANDARD_PARAMETERS):
        for whole, part in (
            (force, MOTIONS[j].force(number)),
            (moment, MOTIONS[j].moment(number)),
        ):
            if part is not None:
                whole += body[symbol] * vector(part)
    of_centre = acceleration + gyration @ com
    assert force == pytest.approx(mass * of_centre, rel=1e-5, abs=1e-5)
    euler = central @ turning + np.cross(velocity, central @ velocity)
    assert moment == pytest.approx(euler + np.cross(com, mass * of_centre), rel=1e-5, abs=1e-5)


def test_the_recursion_ends_at_the_link_that_is_asked_for():
    few = list(link_motions(ARM, Q[:, None], DQ[:, None], DDQ[:, None], last_link=1))
    assert [motion.index for motion in few] == [0, 1]
    assert vector(few[1].acceleration) == pytest.approx(vector(MOTIONS[1].acceleration))
