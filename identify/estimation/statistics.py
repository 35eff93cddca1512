"""Standard deviations of the parameters: classical, and ones that hold for coloured residuals."""

import numpy as np
from numpy.typing import NDArray

from identify.estimation.least_squares import LeastSquares, spread
from identify.estimation.observation import Observation

Array = NDArray[np.float64]

FEWEST_CLUSTERS = 12
"""Blocks are joined to longer ones only while at least this many are left."""

FEWEST_BLOCKS = 6
"""With fewer blocks of time the scatter between them says nothing."""

LARGEST_CORRELATION = 0.97
"""of neighbouring blocks; the bandwidth would otherwise grow beyond the record"""

LARGEST_BANDWIDTH = 0.5
"""part of the record; up to there the fixed-bandwidth quantiles below are tabulated"""

NORMAL = 1.96
"""97.5 % quantile of the normal distribution: an interval of 95 % is value ± 1.96 deviations."""


def classical_deviation(fit: LeastSquares) -> Array:
    """(width,) standard deviations of eq. (13)-(15): residuals taken as white; NaN for columns not fitted."""
    deviation = np.full(len(fit.chi), np.nan)
    freedom = int(fit.rows.sum()) - len(fit.fitted)
    if freedom <= 0 or not len(fit.fitted):
        return deviation
    variance = float(np.sum((fit.weights * fit.residual) ** 2)) / freedom
    inverse = np.linalg.solve(fit.r, np.eye(len(fit.fitted)))
    deviation[fit.fitted] = np.sqrt(variance * np.sum(inverse**2, axis=1))
    return deviation


def robust_deviation(observation: Observation, fit: LeastSquares) -> Array:
    """(width,) standard deviations that hold when residuals are correlated in time; NaN where there are none.

    The influence of a block of time on a parameter is how far the parameter moves when the fit is repeated
    without it. The sum of the influences' autocovariances is the parameter's variance, whatever the colour of
    the residuals (`long_run_deviation`). Value ± 1.96 deviations is an interval of 95 %: the deviation is
    widened for what is not known of itself.
    """
    deviation = np.full(len(fit.chi), np.nan)
    if not len(fit.fitted):
        return deviation
    scale = np.linalg.norm(fit.r, axis=0)
    grams, scores = block_products(observation, fit, scale)
    deviation[fit.fitted] = deviation_from_blocks(grams, scores, grams, observation.sessions) / scale
    return deviation


def deviation_from_blocks(slopes: Array, scores: Array, squares: Array, sessions: NDArray[np.intp]) -> Array:
    """(p,) deviations of an estimate that makes the sum of the blocks' scores zero; NaN where there are none.

    slopes, scores : (blocks, p, p) and (blocks, p): the score of a block falls by slope · dchi; for least squares
                     WᵀW and Wᵀρ
    squares        : (blocks, p, p) covariance of the score for white residuals of unit variance
    sessions       : (blocks,)
    """
    if len(scores) < FEWEST_BLOCKS:
        return np.full(scores.shape[1], np.nan)
    deviation = long_run_deviation(leave_out(slopes, scores), sessions)
    deviation *= student(effective_blocks(slopes, squares) - 1.0) / NORMAL
    return np.where(deviation > 0, deviation, np.nan)


def block_products(observation: Observation, fit: LeastSquares, scale: Array) -> tuple[Array, Array]:
    """WᵀW and the scores Wᵀρ of every block, weighted, columns in units of `scale`: (blocks, p, p), (blocks, p)."""
    grams, scores = [], []
    chi = fit.chi[fit.fitted]
    for factors in observation.factors:
        rows = np.vstack(
            [fit.weights[j] * spread(observation, j, factor) for j, factor in enumerate(factors)]
        )
        residual = rows[:, observation.width] - rows[:, fit.fitted] @ chi
        columns = rows[:, fit.fitted] / scale
        grams.append(columns.T @ columns)
        scores.append(columns.T @ residual)
    return np.array(grams), np.array(scores)


def leave_out(slopes: Array, scores: Array) -> Array:
    """(blocks, p): how far the parameters move when the fit is repeated without a block; exact, not linearised.

    This is the jackknife's influence, which unlike the raw score also holds for blocks with much leverage
    (the CR3 form of cluster-robust covariance: Bell, McCaffrey 2002, Survey Methodology 28(2)).
    """
    left = slopes.sum(0) - slopes
    try:
        moved = -np.linalg.solve(left, scores[:, :, None])[:, :, 0]
    except np.linalg.LinAlgError:
        # One block alone carries a parameter: without it the smallest solution, zero for that parameter.
        moved = -(np.linalg.pinv(left) @ scores[:, :, None])[:, :, 0]
    return moved - moved.mean(0)


def long_run_deviation(influence: Array, sessions: NDArray[np.intp]) -> Array:
    """(p,): root of the sum of autocovariances of the influences, times the widening of its own uncertainty.

    Bartlett's weights; for every parameter the bandwidth of Andrews 1991 (Econometrica 59(3), eq. 6.2 and 6.4,
    AR(1) plug-in) from the correlation of neighbouring blocks; pairs of blocks of different sessions do not
    count. The widening is the ratio of the 97.5 % quantiles at that bandwidth and at zero bandwidth: Kiefer,
    Vogelsang 2005, Econometric Theory 21(6), table 1, Bartlett kernel.
    """
    count = len(influence)
    variance = np.sum(influence**2, axis=0)
    safe = np.where(variance > 0, variance, 1.0)
    correlation = np.clip(_lagged(influence, sessions, 1) / safe, 0.0, LARGEST_CORRELATION)
    shape = 4 * correlation**2 / ((1 - correlation) ** 2 * (1 + correlation) ** 2)
    bandwidth = np.minimum(1.0 + 1.1447 * (shape * count) ** (1 / 3), LARGEST_BANDWIDTH * count)
    for lag in range(1, int(np.ceil(bandwidth.max(initial=1.0)))):
        weight = np.clip(1.0 - lag / bandwidth, 0.0, None)
        variance = variance + 2.0 * weight * _lagged(influence, sessions, lag)
    part = bandwidth / count
    quantile = NORMAL + 2.9694 * part + 0.4160 * part**2 - 0.5324 * part**3
    return np.sqrt(np.maximum(variance, 0.0) * (count - 1) / count) * quantile / NORMAL


def _lagged(influence: Array, sessions: NDArray[np.intp], lag: int) -> Array:
    """(p,) sum of products of the influences of blocks of one session that are `lag` apart."""
    together = sessions[lag:] == sessions[:-lag]
    return np.sum(influence[lag:][together] * influence[:-lag][together], axis=0)


def effective_blocks(slopes: Array, squares: Array) -> Array:
    """(p,): how many blocks carry a parameter's information; with white residuals, (Σh)²/Σh² of their shares h.

    A parameter that shows in a few blocks only (an inertia in a few accelerations) has a deviation that is
    known from a few blocks only (Carter, Schnepel, Steigerwald 2017, Rev. Econ. Stat. 99(4)).
    """
    inverse = np.linalg.pinv(slopes.sum(0), hermitian=True)
    shares = np.einsum("ij,gjk,ik->gi", inverse, squares, inverse, optimize=True)
    return shares.sum(0) ** 2 / np.maximum((shares**2).sum(0), 1e-300)


def joined(sessions: NDArray[np.intp], size: int) -> NDArray[np.intp]:
    """Group index of every block when `size` neighbours of one session make a group."""
    groups = np.zeros(len(sessions), np.intp)
    start = 0
    for session in sorted(set(sessions.tolist())):
        members = np.flatnonzero(sessions == session)
        count = max(1, len(members) // size)
        groups[members] = start + np.minimum(np.arange(len(members)) // size, count - 1)
        start += count
    return groups


def student(freedom: Array) -> Array:
    """97.5 % quantile of Student's distribution (Abramowitz, Stegun 26.7.5), within 1 % from 3 degrees of freedom."""
    z, n = NORMAL, np.maximum(freedom, 3.0)
    return (
        z
        + (z**3 + z) / (4 * n)
        + (5 * z**5 + 16 * z**3 + 3 * z) / (96 * n**2)
        + (3 * z**7 + 19 * z**5 + 17 * z**3 - 15 * z) / (384 * n**3)
    )
