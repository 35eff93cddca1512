"""Evidence for a group of columns that holds when residuals are correlated in time."""

import numpy as np
from numpy.typing import NDArray

from identify.estimation.observation import Observation
from identify.estimation.statistics import FEWEST_CLUSTERS, joined

Array = NDArray[np.float64]
Index = NDArray[np.intp]


def group_p_value(observation: Observation, joint: int, base: Index, extra: Index) -> tuple[float, Array]:
    """Probability of a group of columns' estimates, or larger ones, were they all zero; and the estimates.

    The estimates are those on all motion, one for each of `extra` that the joint's rows carry.
    Wald test with a covariance from the scores of blocks of time (cluster-robust, Liang and Zeger 1986; F with as
    many denominator degrees of freedom as blocks). Neighbouring blocks are joined to longer ones as for
    `std_robust`; the least favourable size counts.
    """
    from scipy.special import fdtrc

    columns = observation.joint_columns[joint]
    place = {int(column): index for index, column in enumerate(columns)}
    inner = np.array([place[int(c)] for c in base if int(c) in place], np.intp)
    outer = np.array([place[int(c)] for c in extra if int(c) in place], np.intp)
    if not len(outer):
        return 1.0, np.zeros(0)
    products = np.array([factors[joint].gram() for factors in observation.factors])
    wanted = np.concatenate([inner, outer])
    target = products.shape[1] - 2
    grams = products[:, wanted][:, :, wanted]
    scores = products[:, wanted, target]
    scale = np.sqrt(np.maximum(np.diag(grams.sum(0)), 1e-300))
    grams = grams / scale[:, None] / scale[None, :]
    scores = scores / scale
    whole = grams.sum(0) + 1e-11 * np.eye(len(wanted))
    inverse = np.linalg.pinv(whole, rcond=1e-10, hermitian=True)
    estimate = inverse @ scores.sum(0)
    found = estimate[len(inner) :] / scale[len(inner) :]
    left = scores - grams @ estimate
    sessions = np.array([block.session for block in observation.blocks])
    tested = np.arange(len(inner), len(wanted))
    worst = 0.0
    for size in (1, 2, 4):
        groups = joined(sessions, size)
        count = int(groups.max()) + 1
        if size > 1 and count < FEWEST_CLUSTERS:
            break
        clustered = np.zeros((count, len(wanted)))
        np.add.at(clustered, groups, left)
        influence = clustered @ inverse[:, tested]
        covariance = influence.T @ influence * count / max(count - 1, 1)
        value = estimate[tested]
        strength = float(value @ np.linalg.pinv(covariance, rcond=1e-10, hermitian=True) @ value)
        rank = len(tested)
        if count <= rank + 1:
            return 1.0, found
        freedom = count - rank
        statistic = strength / rank * freedom / (count - 1)
        worst = max(worst, float(fdtrc(rank, freedom, max(statistic, 0.0))))
    return worst, found
