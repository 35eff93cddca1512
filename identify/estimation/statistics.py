"""Standard deviations of the estimates: the classical ones, and ones that hold for coloured residuals."""

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from identify.estimation.least_squares import LeastSquares, spread
from identify.estimation.observation import Observation

Array = NDArray[np.float64]

FEWEST_CLUSTERS = 12
"""Blocks are joined to longer ones only while at least this many are left."""


def classical_deviation(fit: LeastSquares) -> Array:
    """(width,) standard deviations of eq. (13)-(15): residuals taken as white; NaN for columns not fitted."""
    found = np.full(len(fit.chi), np.nan)
    freedom = int(fit.rows.sum()) - len(fit.fitted)
    if freedom <= 0 or not len(fit.fitted):
        return found
    variance = float(np.sum((fit.weights * fit.residual) ** 2)) / freedom
    inverse = np.linalg.solve(fit.r, np.eye(len(fit.fitted)))
    found[fit.fitted] = np.sqrt(variance * np.sum(inverse**2, axis=1))
    return found


def robust_deviation(observation: Observation, fit: LeastSquares) -> Array:
    """(width,) standard deviations that hold when residuals are correlated in time.

    Delete-one-block jackknife: the fit is repeated without each block of time, and the scatter of these fits is
    the deviation (Künsch 1989, Ann. Statist. 17(3); exact leave-out, the CR3 form of cluster-robust covariance).
    Neighbouring blocks are joined into blocks two and four times as long as long as a dozen are left; of the
    deviations the largest counts, since a block shorter than the residual's memory understates.
    """
    found = np.full(len(fit.chi), np.nan)
    if not len(fit.fitted):
        return found
    scale = np.linalg.norm(fit.r, axis=0)
    grams, products = block_products(observation, fit, scale)
    largest = np.zeros(len(fit.fitted))
    sessions = np.array([block.session for block in observation.blocks])
    for size in (1, 2, 4):
        groups = joined(sessions, size)
        if size > 1 and groups.max() + 1 < FEWEST_CLUSTERS:
            break
        deviation = _jackknife(grams, products, groups)
        if deviation is None:
            break
        largest = np.maximum(largest, deviation)
    found[fit.fitted] = np.where(largest > 0, largest / scale, np.nan)
    return found


def block_products(observation: Observation, fit: LeastSquares, scale: Array) -> tuple[Array, Array]:
    """WᵀW and WᵀY of every block, weighted, columns in units of `scale`: (blocks, p, p) and (blocks, p)."""
    width = observation.width
    grams, products = [], []
    for factors in observation.factors:
        rows = np.vstack(
            [fit.weights[j] * spread(observation, j, factor) for j, factor in enumerate(factors)]
        )
        columns = rows[:, fit.fitted] / scale
        grams.append(columns.T @ columns)
        products.append(columns.T @ rows[:, width])
    return np.array(grams), np.array(products)


def joined(sessions: NDArray[np.intp], size: int) -> NDArray[np.intp]:
    """Group index of every block when `size` neighbours of one session make a group."""
    groups = np.zeros(len(sessions), np.intp)
    start = 0
    for session in np.unique(sessions):
        own = np.flatnonzero(sessions == session)
        count = max(1, len(own) // size)
        groups[own] = start + np.minimum(np.arange(len(own)) // size, count - 1)
        start += count
    return groups


def _jackknife(grams: Array, products: Array, groups: Sequence[int] | NDArray[np.intp]) -> Array | None:
    count = int(np.max(groups)) + 1
    if count < 3:
        return None
    parts = grams.shape[1]
    group_grams, group_products = np.zeros((count, parts, parts)), np.zeros((count, parts))
    np.add.at(group_grams, groups, grams)
    np.add.at(group_products, groups, products)
    left_grams, left_products = group_grams.sum(0) - group_grams, group_products.sum(0) - group_products
    try:
        estimates = np.linalg.solve(left_grams, left_products[:, :, None])[:, :, 0]
    except np.linalg.LinAlgError:
        return None
    spread_of = estimates - estimates.mean(0)
    return np.sqrt((count - 1) / count * np.sum(spread_of**2, axis=0))
