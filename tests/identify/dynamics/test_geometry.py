"""Angles of a robot's frames: those typed for right angles, and those that are none."""

from __future__ import annotations

import numpy as np

from identify.dynamics.geometry import Geometry, nominal_angles
from identify.recording import Joint, Robot


def test_what_people_type_for_right_angles_is_one_and_what_is_further_off_is_kept():
    typed = [1.5708, -1.5708, 3.1416, 6.28319, 0.0]
    np.testing.assert_array_equal(nominal_angles(typed), np.array([1, -1, 2, 4, 0]) * np.pi / 2)
    beside = [np.pi / 2 + 2.1e-5, -2.1e-5, np.pi / 4, 0.3]
    np.testing.assert_array_equal(nominal_angles(beside), beside)
    np.testing.assert_array_equal(nominal_angles([np.pi / 2 - 1.9e-5]), [np.pi / 2])


def test_a_robot_s_geometry_is_its_joints_values_in_order():
    joints = (
        Joint(name="lift", type="prismatic", alpha=1.5708, d=0.1, theta=0.2, r=0.3, drive_gain=1.0),
        Joint(name="turn", type="revolute", alpha=0.4, d=0.5, theta=-1.5708, r=0.7, drive_gain=1.0),
    )
    geometry = Geometry.from_robot(Robot(gravity=(0.0, 1.0, -9.81), joints=joints))
    np.testing.assert_array_equal(geometry.gravity, [0.0, 1.0, -9.81])
    np.testing.assert_array_equal(geometry.alpha, [np.pi / 2, 0.4])
    np.testing.assert_array_equal(geometry.d, [0.1, 0.5])
    np.testing.assert_array_equal(geometry.theta, [0.2, -np.pi / 2])
    np.testing.assert_array_equal(geometry.r, [0.3, 0.7])
    assert geometry.prismatic.tolist() == [True, False]
    assert geometry.names == ("lift", "turn")
    assert geometry.joint_count == 2
