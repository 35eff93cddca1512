"""Base parameters: the fewest parameters from which the torques can be computed, eq. (10).

Numerical QR method: M. Gautier, "Numerical calculation of the base inertial parameters", J. of Robotic
Systems 8(4), 1991 (the paper's [13]). The standard regressor is evaluated at random motions; column after
column, in the order of the standard parameters, a column that the ones before it can make up is given up, and
its parameter is added to theirs with the coefficients found. Keeping the earlier column is what leads to the
usual names: Ia1 goes into ZZ1, YY2 into XX2 and ZZ1, the mass of a link into the link before it.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import ArrayLike, NDArray

from identify.dynamics.geometry import Geometry
from identify.dynamics.regressor import ColumnRequest, compute_columns, standard_regressor
from identify.dynamics.standard_parameters import (
    PARAMETERS_PER_JOINT,
    ROTOR_INERTIA,
    standard_names,
    standard_units,
)

DEPENDENCE_TOLERANCE = 1e-8
"""A column is dependent if what the others leave of it is this part of it. Rounding leaves 1e-14; a link
offset of a tenth of a millimetre leaves 1e-4."""


@dataclass(frozen=True, eq=False)
class BaseParameters:
    """The base parameters of a robot and their regressor.

    names, units, groupings : one entry per base parameter; a name ends in R where others are grouped into it
    joints                  : name of the joint whose link the parameter belongs to
    independent             : (b,) index of each among the standard parameters
    matrix                  : (b, 11 n): base = matrix @ standard
    acts                    : (n, b) bool: whether the parameter makes a torque on the joint
    rotors                  : whether the torque moves the motors' rotors too; False where it is measured on the links' side
    """

    geometry: Geometry
    names: tuple[str, ...]
    units: tuple[str, ...]
    groupings: tuple[str, ...]
    joints: tuple[str, ...]
    independent: NDArray[np.intp]
    matrix: NDArray[np.float64]
    acts: NDArray[np.bool_]
    rotors: bool = True

    def __len__(self) -> int:
        return len(self.names)

    def acts_on(self, joint: int) -> NDArray[np.bool_]:
        """(b,) bool: the base parameters that make a torque on joint `joint` (from 0)."""
        return self.acts[joint]

    def from_standard(self, standard: ArrayLike) -> NDArray[np.float64]:
        """(b,) base parameters of a robot whose (11 n,) standard parameters are known."""
        return self.matrix @ np.asarray(standard, dtype=float)

    def nearest_standard(self, values: ArrayLike, prior: ArrayLike | None = None) -> NDArray[np.float64]:
        """(11 n,) standard parameters nearest to `prior` (or to zero) that have these base parameters.

        A choice among infinitely many: the torques are those identified, the split among links is the
        prior's. Nothing makes it physically feasible; a prior from a drawing is what brings it near.
        """
        start = np.zeros(self.matrix.shape[1]) if prior is None else np.asarray(prior, dtype=float)
        change = np.asarray(values, dtype=float) - self.matrix @ start
        return start + np.linalg.pinv(self.matrix) @ change

    def columns(self, q: ArrayLike, dq: ArrayLike, ddq: ArrayLike) -> NDArray[np.float64]:
        """(N, n, b) minimal regressor D of eq. (10), inertial part; q, dq, ddq are (N, n).

        Samples are contiguous in memory. Where memory matters use `columns_of_joints`, which holds no zeros.
        """
        n, b = self.acts.shape
        rows = np.zeros((n, b, np.shape(q)[0]))
        for joint, columns in enumerate(self.columns_of_joints(q, dq, ddq)):
            rows[joint, self.acts[joint]] = columns.T
        return rows.transpose(2, 0, 1)

    def joint_columns(self, joint: int, q: ArrayLike, dq: ArrayLike, ddq: ArrayLike) -> NDArray[np.float64]:
        """(N, number of `acts_on(joint)`) columns of one joint (from 0), samples contiguous in memory."""
        return self._columns(joint, joint + 1, q, dq, ddq)[0]

    def columns_of_joints(self, q: ArrayLike, dq: ArrayLike, ddq: ArrayLike) -> list[NDArray[np.float64]]:
        """`joint_columns` of every joint; the kinematics is computed once for all of them."""
        return self._columns(0, len(self.acts), q, dq, ddq)

    def _columns(
        self, first: int, last: int, q: ArrayLike, dq: ArrayLike, ddq: ArrayLike
    ) -> list[NDArray[np.float64]]:
        requests = [request for joint in range(first, last) for request in self._requests[joint]]
        offset = requests[0].row if requests else 0
        requests = [ColumnRequest(r.joint, r.link, r.parameter, r.row - offset) for r in requests]
        rows = np.empty((len(requests), np.shape(q)[0]))
        compute_columns(self.geometry, q, dq, ddq, requests, rows)
        counts = np.cumsum([len(self._requests[joint]) for joint in range(first, last)])
        return [part.T for part in np.split(rows, counts[:-1])]

    @cached_property
    def _requests(self) -> list[list[ColumnRequest]]:
        """Columns to compute for each joint, the rows numbered through all joints."""
        requests: list[list[ColumnRequest]] = []
        row = 0
        for joint, mask in enumerate(self.acts):
            ours = []
            for index in self.independent[mask]:
                link, parameter = divmod(int(index), PARAMETERS_PER_JOINT)
                ours.append(ColumnRequest(joint, link, parameter, row))
                row += 1
            requests.append(ours)
        return requests


def base_parameters(geometry: Geometry, rotors: bool = True) -> BaseParameters:
    """The base parameters of a robot, found numerically (Gautier 1991); the same robot gives the same
    result.

    rotors : whether the torque moves the motors' rotors too; it does not where it is measured on the links' side
    """
    regressor = _scattered_regressor(geometry)
    if not rotors:
        regressor[:, :, ROTOR_INERTIA::PARAMETERS_PER_JOINT] = 0.0
    independent, matrix = independent_columns(regressor.reshape(-1, regressor.shape[-1]))
    size = np.abs(regressor[:, :, independent]).max(axis=0, initial=0.0)
    acts = size > DEPENDENCE_TOLERANCE * size.max(axis=0, initial=0.0)
    symbols = standard_names(geometry)
    units = standard_units(geometry)
    groupings = tuple(_grouping(row, index, symbols) for row, index in zip(matrix, independent, strict=True))
    return BaseParameters(
        geometry=geometry,
        names=tuple(
            symbols[index] + ("R" if np.count_nonzero(row) > 1 else "")
            for row, index in zip(matrix, independent, strict=True)
        ),
        units=tuple(units[index] for index in independent),
        groupings=groupings,
        joints=tuple(geometry.names[index // PARAMETERS_PER_JOINT] for index in independent),
        independent=independent,
        matrix=matrix,
        acts=acts,
        rotors=rotors,
    )


def independent_columns(regressor: NDArray[np.float64]) -> tuple[NDArray[np.intp], NDArray[np.float64]]:
    """Columns that those before them cannot make up, and the matrix that groups the others into them.

    regressor : (rows, p), with more rows than columns
    Returns     (b,) indices of the independent columns and the (b, p) matrix G with regressor = regressor[:,
                b] G
    """
    norms = np.linalg.norm(regressor, axis=0)
    scale = np.where(norms > DEPENDENCE_TOLERANCE * norms.max(initial=0.0), norms, np.inf)
    # the triangular factor has the products of the columns in as many rows as columns
    scaled = np.asarray(np.linalg.qr(regressor / scale, mode="r"), dtype=np.float64)
    basis = np.zeros((len(scaled), 0))
    independent: list[int] = []
    for index in range(scaled.shape[1]):
        rest = scaled[:, index]
        for _ in range(2):  # twice is enough: the second pass removes what rounding left of the first
            rest = rest - basis @ (basis.T @ rest)
        left = np.linalg.norm(rest)
        if left > DEPENDENCE_TOLERANCE:
            basis = np.column_stack([basis, rest / left])
            independent.append(index)
    matrix = np.zeros((len(independent), scaled.shape[1]))
    if independent:
        combinations = np.linalg.lstsq(scaled[:, independent], scaled, rcond=None)[0]
        matrix = np.asarray(combinations, dtype=np.float64)
        matrix[np.abs(matrix) < DEPENDENCE_TOLERANCE] = 0.0
        matrix *= np.where(np.isfinite(scale), scale, 0.0) / scale[independent][:, np.newaxis]
        matrix[:, independent] = np.eye(len(independent))
        matrix = _without_rounding(matrix)
    return np.array(independent, dtype=np.intp), matrix


def _scattered_regressor(geometry: Geometry) -> NDArray[np.float64]:
    """Standard regressor at motions that fill their range evenly, the same for the same number of joints.

    They are the points of an additive recurrence with the powers of 1/φ, φ the root of φ^(d+1) = φ + 1 in d
    dimensions (Roberts 2018, "The unreasonable effectiveness of quasirandom sequences"): no two coordinates are
    related, and `numpy.random`, which takes 20 ms to import, is not needed.
    """
    n = geometry.joint_count
    samples, dimensions = 4 * PARAMETERS_PER_JOINT * n, 3 * n
    root = 2.0
    for _ in range(64):
        root = (1.0 + root) ** (1.0 / (dimensions + 1))
    steps = root ** -np.arange(1.0, dimensions + 1)
    points = 2.0 * np.modf(0.5 + np.outer(np.arange(1, samples + 1), steps))[0] - 1.0
    q, dq, ddq = np.split(points * np.repeat([np.pi, 3.0, 10.0], n), 3, axis=1)
    return standard_regressor(geometry, q, dq, ddq)


def _without_rounding(matrix: NDArray[np.float64]) -> NDArray[np.float64]:
    """Coefficients that are a small whole number up to rounding become that number."""
    whole = np.round(matrix)
    return np.where(np.abs(matrix - whole) < 1e-9, whole, matrix)


def _grouping(coefficients: NDArray[np.float64], column: int, symbols: tuple[str, ...]) -> str:
    """The sum in words: its own parameter first, then the others in the standard order, `ZZ1 + Ia1 - 0.225
    MY2`.
    """
    text = symbols[column]
    for index in np.flatnonzero(coefficients):
        if index == column:
            continue
        value = coefficients[index]
        size = "" if abs(value) == 1.0 else f"{abs(value):.6g} "
        text += f" {'+' if value > 0 else '-'} {size}{symbols[index]}"
    return text
