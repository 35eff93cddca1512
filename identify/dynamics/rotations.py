"""Rotations as files of robots write them: roll, pitch and yaw, and quaternions."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
RIGHT_PITCH = 1.5e-8
"""Cosine of the pitch below which roll and yaw are one angle. Taking it for zero is wrong by so much, and the rounding of the
rotation's entries (1e-16) divided by it is what the angles are wrong by otherwise; here both are the same."""


def roll_pitch_yaw(rotation: Array) -> Array:
    """(3,) rad: R = Rz(yaw) Ry(pitch) Rx(roll); where the pitch is a right angle the yaw is taken as zero."""
    pitch = math.atan2(-rotation[2, 0], math.hypot(rotation[0, 0], rotation[1, 0]))
    if math.hypot(rotation[0, 0], rotation[1, 0]) < RIGHT_PITCH:
        roll = math.atan2(math.copysign(1.0, -rotation[2, 0]) * rotation[0, 1], rotation[1, 1])
        return np.array([roll, pitch, 0.0])
    return np.array(
        [
            math.atan2(rotation[2, 1], rotation[2, 2]),
            pitch,
            math.atan2(rotation[1, 0], rotation[0, 0]),
        ]
    )


def from_roll_pitch_yaw(angles: Array) -> Array:
    """(3, 3) rotation of `roll_pitch_yaw`."""
    (cr, cp, cy), (sr, sp, sy) = np.cos(angles), np.sin(angles)
    return np.array(
        [
            [cy * cp, cy * sp * sr - sy * cr, cy * sp * cr + sy * sr],
            [sy * cp, sy * sp * sr + cy * cr, sy * sp * cr - cy * sr],
            [-sp, cp * sr, cp * cr],
        ]
    )


def quaternion(rotation: Array) -> Array:
    """(4,) w x y z of a rotation; of the four ways to compute it the one with the largest divisor."""
    trace = float(np.trace(rotation))
    squares = [trace, *(2.0 * float(rotation[axis, axis]) - trace for axis in range(3))]
    largest = int(np.argmax(squares))
    part = math.sqrt(1.0 + squares[largest])
    off = [rotation[2, 1] - rotation[1, 2], rotation[0, 2] - rotation[2, 0], rotation[1, 0] - rotation[0, 1]]
    if largest == 0:
        return 0.5 * np.array([part, *(value / part for value in off)])
    axis = largest - 1
    values = np.zeros(4)
    values[0] = off[axis] / part
    for other in range(3):
        both = rotation[axis, other] + rotation[other, axis]
        values[1 + other] = part if other == axis else both / part
    return 0.5 * values


def from_quaternion(values: Array) -> Array:
    """(3, 3) rotation of w x y z."""
    w, x, y, z = values / np.linalg.norm(values)
    return np.array(
        [
            [1 - 2 * (y * y + z * z), 2 * (x * y - z * w), 2 * (x * z + y * w)],
            [2 * (x * y + z * w), 1 - 2 * (x * x + z * z), 2 * (y * z - x * w)],
            [2 * (x * z - y * w), 2 * (y * z + x * w), 1 - 2 * (x * x + y * y)],
        ]
    )
