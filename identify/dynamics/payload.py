"""Torque of a payload fixed to the last link, eq. (32)-(35), for any serial robot."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Protocol

import numpy as np
from numpy.typing import ArrayLike, NDArray

from identify.dynamics.geometry import Geometry
from identify.dynamics.regressor import ColumnRequest, compute_columns
from identify.dynamics.standard_parameters import LINK_PARAMETERS


class PayloadDescription(Protocol):
    """What is read of a payload; `identify.recording`'s payload has it."""

    @property
    def mass(self) -> float:
        """kg"""
        ...

    @property
    def com(self) -> Sequence[float]:
        """(3,) m, centre of mass in the last link's frame"""
        ...

    @property
    def inertia(self) -> Sequence[float]:
        """(6,) kg m², XX XY XZ YY YZ ZZ about the centre of mass"""
        ...


def payload_parameters(payload: PayloadDescription) -> NDArray[np.float64]:
    """(10,) link parameters XX .. ZZ, MX, MY, MZ, M of a payload about the last frame's origin.

    The inertia is given about the centre of mass (kg m^2); the Huygens theorem carries it to the origin, eq.
    (33).
    """
    x, y, z = (float(value) for value in payload.com)
    mass = float(payload.mass)
    about_origin = mass * np.array([y * y + z * z, -x * y, -x * z, x * x + z * z, -y * z, x * x + y * y])
    about_origin += np.asarray(payload.inertia, dtype=float)
    return np.concatenate([about_origin, mass * np.array([x, y, z]), [mass]])


def payload_torque(
    geometry: Geometry, payload: PayloadDescription, q: ArrayLike, dq: ArrayLike, ddq: ArrayLike
) -> NDArray[np.float64]:
    """Torque that a known payload asks of each joint; for one joint M_a L_a (L_a ddq + g cos q) of eq. (34).

    q, dq, ddq : (N, n) rad or m
    Returns      (N, n) N m or N
    """
    parameters = payload_parameters(payload)
    present = np.flatnonzero(parameters)
    torque = np.zeros((geometry.joint_count, np.shape(q)[0]))
    columns = _payload_rows(geometry, present.tolist(), q, dq, ddq)
    for joint in range(geometry.joint_count):
        torque[joint] = parameters[present] @ columns[joint]
    return torque.T


def payload_regressor(
    geometry: Geometry, q: ArrayLike, dq: ArrayLike, ddq: ArrayLike, joints: Sequence[int] | None = None
) -> NDArray[np.float64]:
    """(N, n, 10) torque per unit of each link parameter of an unknown payload, in the order of
    `LINK_PARAMETERS`; of all n joints, or of some (from 0).
    """
    rows = _payload_rows(geometry, list(range(len(LINK_PARAMETERS))), q, dq, ddq, joints)
    return rows.transpose(2, 0, 1)


def _payload_rows(
    geometry: Geometry,
    parameters: list[int],
    q: ArrayLike,
    dq: ArrayLike,
    ddq: ArrayLike,
    joints: Sequence[int] | None = None,
) -> NDArray[np.float64]:
    """(joints, parameters, N)"""
    chosen = range(geometry.joint_count) if joints is None else joints
    width, last = len(parameters), geometry.joint_count - 1
    requests = [
        ColumnRequest(joint, last, parameter, index * width + place)
        for index, joint in enumerate(chosen)
        for place, parameter in enumerate(parameters)
    ]
    rows = np.zeros((len(chosen) * width, np.shape(q)[0]))
    compute_columns(geometry, q, dq, ddq, requests, rows)
    return rows.reshape(len(chosen), width, rows.shape[1])
