"""Geometry of a serial robot in modified Denavit-Hartenberg frames (Khalil-Kleinfinger)."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Literal, Protocol

import numpy as np
from numpy.typing import NDArray

NOMINAL_ANGLE_TOLERANCE = 2e-5
"""rad. An angle this close to a multiple of pi/2 is taken to be that multiple.

1.5708 and 3.1416, as people type them, are 4e-6 and 7e-6 rad off. Left so, the frames are not quite square
and the numerical search for base parameters finds parameters whose effect is a millionth of their
neighbours'. No robot is known to 2e-5 rad (20 um per metre), so nothing is lost."""


class JointDescription(Protocol):
    """What is read of a joint; `identify.recording`'s joint has it."""

    @property
    def name(self) -> str:
        """Name of the joint."""
        ...

    @property
    def type(self) -> Literal["revolute", "prismatic"]:
        """Whether it turns about or slides along its z axis."""
        ...

    @property
    def alpha(self) -> float:
        """rad, about x of the frame before"""
        ...

    @property
    def d(self) -> float:
        """m, along x of the frame before"""
        ...

    @property
    def theta(self) -> float:
        """rad, about z; a revolute joint's position is added"""
        ...

    @property
    def r(self) -> float:
        """m, along z; a prismatic joint's position is added"""
        ...


class RobotDescription(Protocol):
    """What is read of a robot; `identify.recording.Robot` has it."""

    @property
    def gravity(self) -> Sequence[float]:
        """(3,) m/s², in the base frame"""
        ...

    @property
    def joints(self) -> Sequence[JointDescription]:
        """(n,) from base to tip"""
        ...


@dataclass(frozen=True, eq=False)
class Geometry:
    """Frames of a serial robot, base to tip, one array entry per joint.

    Frame j in frame j-1 is Rot(x, alpha) Trans(x, d) Rot(z, theta) Trans(z, r). The joint moves about
    (revolute) or along (prismatic) its own z: theta = q + offset or r = q + offset.
    Source: W. Khalil and J.-F. Kleinfinger, ICRA 1986; the paper's [11].

    gravity   : (3,) m/s^2, in the base frame
    alpha     : (n,) rad
    d         : (n,) m
    theta     : (n,) rad; for a revolute joint the constant added to q
    r         : (n,) m; for a prismatic joint the constant added to q
    prismatic : (n,) bool
    names     : joint names
    """

    gravity: NDArray[np.float64]
    alpha: NDArray[np.float64]
    d: NDArray[np.float64]
    theta: NDArray[np.float64]
    r: NDArray[np.float64]
    prismatic: NDArray[np.bool_]
    names: tuple[str, ...]

    @classmethod
    def from_robot(cls, robot: RobotDescription) -> Geometry:
        """The geometry of an experiment's robot. Angles within `NOMINAL_ANGLE_TOLERANCE` of a right angle
        become one.
        """
        joints = robot.joints
        return cls(
            gravity=np.asarray(robot.gravity, dtype=float),
            alpha=nominal_angles([joint.alpha for joint in joints]),
            d=np.array([joint.d for joint in joints], dtype=float),
            theta=nominal_angles([joint.theta for joint in joints]),
            r=np.array([joint.r for joint in joints], dtype=float),
            prismatic=np.array([joint.type == "prismatic" for joint in joints]),
            names=tuple(joint.name for joint in joints),
        )

    @property
    def joint_count(self) -> int:
        """Number of joints, n."""
        return len(self.alpha)


def nominal_angles(angles: Sequence[float]) -> NDArray[np.float64]:
    """Angles (rad), those within `NOMINAL_ANGLE_TOLERANCE` of a multiple of pi/2 replaced by that
    multiple.
    """
    given = np.asarray(angles, dtype=float)
    right = np.round(given / (np.pi / 2)) * (np.pi / 2)
    return np.where(np.abs(given - right) < NOMINAL_ANGLE_TOLERANCE, right, given)
