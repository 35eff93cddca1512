"""Global least squares over all sessions, eq. (12), on triangular factors."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from identify.estimation.observation import Observation
from identify.estimation.triangular_factor import TriangularFactor, triangle

Array = NDArray[np.float64]

DEPENDENCE = 1e-7
"""A column of which less than this part is left beside the columns before it is not identifiable on these
data.
"""

WEIGHT_ITERATIONS = 3
"""Passes over the weights; they change by less than a percent after the second."""


@dataclass(frozen=True, eq=False)
class LeastSquares:
    """A least squares solution.

    chi      : (width,) value of every column's parameter; 0 for a column not fitted
    fitted   : global indices of the columns fitted
    dropped  : global indices of columns asked for that the data cannot tell from those before them
    r        : triangular factor of the weighted, fitted columns
    weights  : (n,) weight of each joint's rows
    residual : (n,) norm of each joint's residual, unweighted
    norm     : (n,) norm of each joint's measured torque
    rows     : (n,) samples
    free     : (width,) what least squares alone would find, where `chi` was brought inside what parameters can be
    """

    chi: Array
    fitted: NDArray[np.intp]
    dropped: NDArray[np.intp]
    r: Array
    weights: Array
    residual: Array
    norm: Array
    rows: NDArray[np.intp]
    free: Array | None = None

    @property
    def relative_error(self) -> float:
        """‖Y − Wχ‖ / ‖Y‖ over all joints."""
        return float(np.linalg.norm(self.residual) / np.linalg.norm(self.norm))

    @property
    def condition_number(self) -> float:
        """Condition number of W, its columns brought to unit norm."""
        if not len(self.fitted):
            return float("nan")
        return float(np.linalg.cond(self.r / np.linalg.norm(self.r, axis=0)))


def joint_rows(observation: Observation, joint: int, blocks: Sequence[int] | None = None) -> Array:
    """Rows of a joint's merged factor, spread to [all columns, Y, tau]."""
    factor = observation.merged(joint, blocks)
    return spread(observation, joint, factor)


def spread(observation: Observation, joint: int, factor: TriangularFactor) -> Array:
    """A joint's factor with zero columns where the joint has none."""
    width = observation.width
    rows = np.zeros((len(factor.r), width + 2))
    rows[:, observation.joint_columns[joint]] = factor.r[:, :-2]
    rows[:, width:] = factor.r[:, -2:]
    return rows


def least_squares(
    observation: Observation,
    columns: Sequence[int] | NDArray[np.intp] | None = None,
    blocks: Sequence[int] | None = None,
    weights: Array | None = None,
) -> LeastSquares:
    """Fit some columns (all if not said) to the blocks (all if not said).

    weights : (n,) of the joints' rows; if not given, the inverse of each joint's own residual deviation,
    found
              by iteration (weighted least squares; with one joint it is the ordinary one)
    """
    joints = len(observation.joint_columns)
    wanted = np.arange(observation.width) if columns is None else np.asarray(columns, np.intp)
    rows = [joint_rows(observation, joint, blocks) for joint in range(joints)]
    chosen = range(len(observation.blocks)) if blocks is None else blocks
    counts = np.array(
        [sum(observation.factors[block][joint].rows for block in chosen) for joint in range(joints)], np.intp
    )
    norm = np.array([float(np.linalg.norm(part[:, -1])) for part in rows])
    present = np.ones(joints) if weights is None else weights
    if weights is None and joints > 1:
        for _ in range(WEIGHT_ITERATIONS - 1):
            chi, _, _ = _solve(_weighted(rows, present), wanted)
            present = _inverse_deviations(_residual_norms(rows, chi), norm, counts)
    chi, fitted, r = _solve(_weighted(rows, present), wanted)
    dropped = wanted[~np.isin(wanted, fitted)]
    return LeastSquares(chi, fitted, dropped, r, present, _residual_norms(rows, chi), norm, counts)


def residual_norms(observation: Observation, chi: Array) -> Array:
    """(n,) norm of Y - W chi of each joint, over all blocks."""
    return _residual_norms([joint_rows(observation, j) for j in range(len(observation.joint_columns))], chi)


def _weighted(rows: Sequence[Array], weights: Array) -> Array:
    return np.vstack([part * weight for part, weight in zip(rows, weights, strict=True)])


def _residual_norms(rows: Sequence[Array], chi: Array) -> Array:
    """(n,) norm of Y - W chi of each joint."""
    return np.array([float(np.linalg.norm(part[:, -2] - part[:, :-2] @ chi)) for part in rows])


def _inverse_deviations(residual: Array, norm: Array, counts: NDArray[np.intp]) -> Array:
    """(n,) weight of each joint; a joint fitted to rounding counts no more than its rounding deserves."""
    samples = np.sqrt(np.maximum(counts, 1))
    deviation = np.maximum(residual, 1e-6 * norm) / samples
    return 1.0 / np.where(deviation > 0, deviation, 1.0)


def _solve(stacked: Array, wanted: NDArray[np.intp]) -> tuple[Array, NDArray[np.intp], Array]:
    """Solve on stacked rows [all columns, Y, tau]; returns chi (width,), the columns fitted and their
    factor.
    """
    width = stacked.shape[1] - 2
    norms = np.linalg.norm(stacked[:, wanted], axis=0)
    chi = np.zeros(width)
    useful = wanted[norms > 0]
    if not len(useful):
        return chi, useful, np.zeros((0, 0))
    scale = norms[norms > 0]
    r = triangle(np.hstack([stacked[:, useful] / scale, stacked[:, width : width + 1]]))
    columns = len(useful)
    independent = _independent(r[: min(len(r), columns), :columns])
    if not independent.all():
        useful, scale = useful[independent], scale[independent]
        r = triangle(np.hstack([stacked[:, useful] / scale, stacked[:, width : width + 1]]))
        columns = len(useful)
    chi[useful] = np.linalg.solve(r[:columns, :columns], r[:columns, columns]) / scale
    return chi, useful, r[:columns, :columns] * scale


def _independent(r: Array) -> NDArray[np.bool_]:
    """Which columns (of unit norm) are not made up of those before them."""
    columns = r.shape[1]
    kept = np.zeros(columns, bool)
    basis = np.zeros((r.shape[0], 0))
    if r.shape[0] == columns and np.abs(np.diag(r)).min() > DEPENDENCE:
        return np.ones(columns, bool)
    for index in range(columns):
        rest = r[:, index] - basis @ (basis.T @ r[:, index])
        rest -= basis @ (basis.T @ rest)
        left = np.linalg.norm(rest)
        if left > DEPENDENCE:
            kept[index] = True
            basis = np.column_stack([basis, rest / left])
    return kept
