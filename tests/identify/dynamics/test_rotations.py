"""Rotations against SciPy's, at the right pitch where roll and yaw cannot be told apart, and with each way of a quaternion."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from identify.dynamics.rotations import from_quaternion, from_roll_pitch_yaw, quaternion, roll_pitch_yaw

ANGLES = [(0.3, -0.5, 1.1), (-2.9, 1.2, 2.4), (1.0, 0.0, -3.0), (0.0, -1.5, 0.2), (2.2, 0.7, -0.9)]
HALF_TURNS = [(3.0, 0.1, 0.2), (0.1, 3.0, 0.2), (0.1, 0.2, 3.0), (-0.2, 0.3, 0.1)]
"""rotation vectors of which x, y, z and w in turn are the largest part of the quaternion"""


@pytest.mark.parametrize("angles", ANGLES)
def test_roll_pitch_and_yaw_are_scipys_fixed_axes_and_come_back(angles):
    """URDF turns about x, then y, then z, all of them standing still."""
    rotation = from_roll_pitch_yaw(np.array(angles))
    np.testing.assert_allclose(rotation, Rotation.from_euler("xyz", angles).as_matrix(), atol=1e-15)
    np.testing.assert_allclose(roll_pitch_yaw(rotation), angles, atol=1e-14)


@pytest.mark.parametrize("pitch", [np.pi / 2, -np.pi / 2])
def test_at_a_right_pitch_the_yaw_is_zero_and_the_rotation_the_same(pitch):
    """Of the one turn about the vertical that roll and yaw then share, all is in the roll."""
    rotation = Rotation.from_euler("xyz", [0.4, pitch, 0.9]).as_matrix()
    angles = roll_pitch_yaw(rotation)
    assert angles[2] == 0.0
    np.testing.assert_allclose(angles[1], pitch, atol=1e-7)
    np.testing.assert_allclose(angles[0], 0.4 - np.sign(pitch) * 0.9, atol=1e-7)
    np.testing.assert_allclose(from_roll_pitch_yaw(angles), rotation, atol=1e-7)


@pytest.mark.parametrize("distance", [2e-8, 1e-6])
def test_just_beside_a_right_pitch_the_yaw_is_kept(distance):
    angles = np.array([0.4, np.pi / 2 - distance, 0.9])
    found = roll_pitch_yaw(from_roll_pitch_yaw(angles))
    assert found[2] != 0.0
    np.testing.assert_allclose(from_roll_pitch_yaw(found), from_roll_pitch_yaw(angles), atol=1e-7)


@pytest.mark.parametrize("vector", HALF_TURNS)
def test_quaternions_are_scipys_either_way(vector):
    turn = Rotation.from_rotvec(vector)
    x, y, z, w = turn.as_quat()
    expected = np.array([w, x, y, z])
    got = quaternion(turn.as_matrix())
    np.testing.assert_allclose(got * np.sign(got @ expected), expected, atol=1e-14)
    # of any length: files round what they write
    np.testing.assert_allclose(from_quaternion(3.0 * expected), turn.as_matrix(), atol=1e-14)
