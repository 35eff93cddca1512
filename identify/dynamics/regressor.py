"""Regressor of the inverse dynamic model in the standard parameters, eq. (9), vectorised over the samples.

Newton-Euler in the links' own frames (paper's [11], chapter 9). For link j with angular velocity w, angular
acceleration w' and acceleration a of its origin O_j (gravity included), its ten parameters make at O_j

    force  f = M a + U MS            U = [w']x + [w]x [w]x
    moment n = J w' + w x J w + MS x a

and joint i feels  tau_i = z_i . n + (z_i x O_i O_j) . f  (revolute) or  tau_i = z_i . f  (prismatic), all in
frame j.

Constant components are folded away (`constant_folding.py`); samples are taken in blocks whose intermediate
arrays stay in the processor's cache.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from identify.dynamics.constant_folding import Component, Vector, is_zero, product
from identify.dynamics.geometry import Geometry
from identify.dynamics.link_motion import LinkMotion, link_motions
from identify.dynamics.standard_parameters import LINK_PARAMETERS, PARAMETERS_PER_JOINT

BLOCK_SAMPLES = 8192
"""Samples taken at once: about a hundred arrays of 64 kB are alive. Measured, six joints: 0.83 µs a sample with 2048,
0.67 with 4096, 0.60 with 8192; Python's own part of the work shrinks faster than the caches lose."""

ROTOR = len(LINK_PARAMETERS)
"""Index of Ia among the parameters of a joint."""


@dataclass(frozen=True)
class ColumnRequest:
    """One column to compute: the torque on `joint` per unit of `parameter` of `link`, into row `row` of the
    result.
    """

    joint: int
    link: int
    parameter: int
    row: int


def standard_regressor(
    geometry: Geometry, q: ArrayLike, dq: ArrayLike, ddq: ArrayLike
) -> NDArray[np.float64]:
    """Standard regressor D_St of eq. (9), inertial part.

    q, dq, ddq : (N, n) joint positions, velocities, accelerations, rad or m
    Returns      (N, n, 11 n): torque (N m or N) on each joint per unit of each standard parameter, in the
                 order of `standard_names`. The samples are contiguous in memory.
    """
    n = geometry.joint_count
    width = PARAMETERS_PER_JOINT * n
    requests = [
        ColumnRequest(joint, link, parameter, joint * width + link * PARAMETERS_PER_JOINT + parameter)
        for link in range(n)
        for joint in range(link + 1)
        for parameter in range(PARAMETERS_PER_JOINT)
        if parameter != ROTOR or joint == link
    ]
    samples = np.shape(q)[0]
    rows = np.zeros((n * width, samples))
    compute_columns(geometry, q, dq, ddq, requests, rows)
    return rows.reshape(n, width, samples).transpose(2, 0, 1)


def compute_columns(
    geometry: Geometry,
    q: ArrayLike,
    dq: ArrayLike,
    ddq: ArrayLike,
    requests: list[ColumnRequest],
    rows: NDArray[np.float64],
) -> None:
    """Write the requested columns of the standard regressor into `rows`.

    q, dq, ddq : (N, n)
    rows       : (>= number of requests, N), overwritten at the requested rows; other rows are left alone
    Raises ValueError if the shapes do not match the robot.
    """
    motion = [np.asarray(array, dtype=float) for array in (q, dq, ddq)]
    for array in motion:
        if array.shape != (rows.shape[1], geometry.joint_count):
            raise ValueError(
                f"positions, velocities and accelerations must be ({rows.shape[1]}, {geometry.joint_count}), "
                f"not {array.shape}"
            )
    wanted: dict[int, dict[int, list[ColumnRequest]]] = {}
    for request in requests:
        wanted.setdefault(request.link, {}).setdefault(request.parameter, []).append(request)
    last_link = max(wanted, default=-1)
    for start in range(0, rows.shape[1], BLOCK_SAMPLES):
        block = slice(start, min(start + BLOCK_SAMPLES, rows.shape[1]))
        positions, velocities, accelerations = (np.ascontiguousarray(array[block].T) for array in motion)
        for link in link_motions(geometry, positions, velocities, accelerations, last_link):
            for parameter, asked in wanted.get(link.index, {}).items():
                moment, force = link.moment(parameter), link.force(parameter)
                for request in asked:
                    out = rows[request.row, block]
                    if request.joint > link.index:
                        out[:] = 0.0  # a link makes no torque on the joints beyond it
                    elif parameter == ROTOR:
                        # Ia_j is referred to the joint: it is felt there and nowhere else
                        out[:] = accelerations[request.joint] if request.joint == link.index else 0.0
                    else:
                        _write_column(link, request.joint, moment, force, out)


def _write_column(
    link: LinkMotion, joint: int, moment: Vector | None, force: Vector | None, out: NDArray[np.float64]
) -> None:
    """One column over a block of samples: z_i . n + (z_i x O_i O_j) . f, into `out`."""
    pairs: list[tuple[Component, Component]] = []
    rotation = link.rotations[joint]
    if rotation is not None and moment is not None:
        pairs += zip(rotation, moment, strict=True)
    if force is not None:
        pairs += zip(link.translations[joint], force, strict=True)
    terms = [pair for pair in pairs if not (is_zero(pair[0]) or is_zero(pair[1]))]
    if not terms:
        out[:] = 0.0
        return
    np.multiply(*terms[0], out=out)
    for left, right in terms[1:]:
        out += product(left, right)
