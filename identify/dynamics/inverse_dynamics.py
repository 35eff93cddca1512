"""Torque of a rigid robot whose standard parameters are known: the recursive Newton-Euler algorithm, over many samples.

The regressor gives a column for each parameter; a simulation has the parameters already and wants the torque alone,
thousands of times for a few samples each. The recursion is that of `regressor.py` (the paper's [11], chapter 9).
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from identify.dynamics.geometry import Geometry
from identify.dynamics.standard_parameters import PARAMETERS_PER_JOINT

Array = NDArray[np.float64]

_SKEW = np.zeros((3, 9))
_SKEW[0, [5, 7]] = -1.0, 1.0
_SKEW[1, [2, 6]] = 1.0, -1.0
_SKEW[2, [1, 3]] = -1.0, 1.0


class InverseDynamics:
    """Torques of one or more sets of standard parameters on the same motion.

    geometry : the robot's frames
    standard : sets of (11 n,) parameters, in the order of `standard_names`, SI units
    """

    def __init__(self, geometry: Geometry, standard: Sequence[Array]) -> None:
        self.geometry = geometry
        self._sets = [
            [_Link(parameters) for parameters in np.reshape(one, (-1, PARAMETERS_PER_JOINT))]
            for one in standard
        ]

    def torques(self, q: Array, dq: Array, ddq: Array) -> list[Array]:
        """For each set of parameters the torques (N, n), N m or N, of a motion q, dq, ddq (N, n)."""
        geometry, n = self.geometry, q.shape[1]
        angle = np.where(geometry.prismatic, geometry.theta, geometry.theta + q)
        along = np.where(geometry.prismatic, geometry.r + q, geometry.r)
        cosine, sine = np.cos(angle), np.sin(angle)
        rotations, offsets, motions = [], [], []
        rate = np.zeros((len(q), 3, 1))
        change = np.zeros((len(q), 3, 1))
        acceleration = np.broadcast_to(-np.asarray(geometry.gravity, float)[:, None], (len(q), 3, 1))
        for joint in range(n):
            rotation, offset = self._frame(joint, cosine[:, joint], sine[:, joint], along[:, joint])
            back = rotation.transpose(0, 2, 1)
            whole = _skew(change) + (spin := _skew(rate)) @ spin
            acceleration = back @ (acceleration + whole @ offset)
            rate, change = back @ rate, back @ change
            if geometry.prismatic[joint]:
                acceleration[:, 2, 0] += ddq[:, joint]
                # 2 w x (z q')
                acceleration[:, 0, 0] += 2 * rate[:, 1, 0] * dq[:, joint]
                acceleration[:, 1, 0] -= 2 * rate[:, 0, 0] * dq[:, joint]
            else:
                change[:, 0, 0] += rate[:, 1, 0] * dq[:, joint]
                change[:, 1, 0] -= rate[:, 0, 0] * dq[:, joint]
                change[:, 2, 0] += ddq[:, joint]
                rate[:, 2, 0] += dq[:, joint]
            rotations.append(rotation)
            offsets.append(offset)
            spin = _skew(rate)
            motions.append((rate, change, acceleration, spin, _skew(change) + spin @ spin))
        return [self._backwards(links, rotations, offsets, motions, ddq) for links in self._sets]

    def _frame(self, joint: int, cosine: Array, sine: Array, along: Array) -> tuple[Array, Array]:
        """Rotation (N, 3, 3) and origin (N, 3, 1) of a joint's frame in the one before."""
        ca, sa = np.cos(self.geometry.alpha[joint]), np.sin(self.geometry.alpha[joint])
        rotation = np.empty((len(cosine), 3, 3))
        rotation[:, 0, 0], rotation[:, 0, 1], rotation[:, 0, 2] = cosine, -sine, 0.0
        rotation[:, 1, 0], rotation[:, 1, 1], rotation[:, 1, 2] = ca * sine, ca * cosine, -sa
        rotation[:, 2, 0], rotation[:, 2, 1], rotation[:, 2, 2] = sa * sine, sa * cosine, ca
        offset = np.empty((len(cosine), 3, 1))
        offset[:, 0, 0] = self.geometry.d[joint]
        offset[:, 1, 0], offset[:, 2, 0] = -sa * along, ca * along
        return rotation, offset

    def _backwards(
        self,
        links: Sequence[_Link],
        rotations: Sequence[Array],
        offsets: Sequence[Array],
        motions: Sequence[tuple[Array, ...]],
        ddq: Array,
    ) -> Array:
        torque = np.empty(ddq.shape)
        force = moment = None
        for joint in range(len(links) - 1, -1, -1):
            link = links[joint]
            rate, change, acceleration, spin, whole = motions[joint]
            own_force = link.mass * acceleration + whole @ link.first
            own_moment = link.inertia @ change + spin @ (link.inertia @ rate) + link.first_skew @ acceleration
            if force is not None and moment is not None:
                carried = rotations[joint + 1] @ force
                own_force = own_force + carried
                own_moment = own_moment + rotations[joint + 1] @ moment + _skew(offsets[joint + 1]) @ carried
            force, moment = own_force, own_moment
            felt = force if self.geometry.prismatic[joint] else moment
            torque[:, joint] = felt[:, 2, 0] + link.rotor * ddq[:, joint]
        return torque


class _Link:
    """One link's parameters as the recursion uses them."""

    def __init__(self, parameters: Array) -> None:
        xx, xy, xz, yy, yz, zz, mx, my, mz, mass, rotor = (float(value) for value in parameters)
        self.inertia = np.array([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]])
        self.first = np.array([[mx], [my], [mz]])
        self.first_skew = _skew(self.first[None])[0]
        self.mass, self.rotor = mass, rotor


def _skew(vectors: Array) -> Array:
    """(N, 3, 3) matrices whose product with a vector is the cross product, of vectors (N, 3, 1)."""
    return (vectors[:, :, 0] @ _SKEW).reshape(-1, 3, 3)
