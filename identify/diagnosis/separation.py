"""How far two effects of a joint part, in the noise that the data show, and what the diagnosis then makes of it.

The noise is that along what the one cannot follow of the other, from the scores of blocks of time, as in the test by which the
diagnosis tells two effects apart (`evidence.py`), and no less than that of as many independent samples as the residual's memory
leaves. The probability is what the diagnosis gives the right one of the two (`probability.shares`): with separation d the
logarithm of their likelihoods differs by d²/2 with the variance d², and the bootstrap over stretches of the motion scatters it by
as much again. Where one is a special case of the other no motion speaks for it (`expected_share`).
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from identify.diagnosis.evidence import joined_influences
from identify.diagnosis.probability import independent_samples
from identify.estimation.fitted_model import FittedModel
from identify.estimation.observation import Observation
from identify.estimation.prediction import predict_sessions

Array = NDArray[np.float64]
Index = NDArray[np.intp]

NODES, _weights = np.polynomial.hermite_e.hermegauss(60)
WEIGHTS = _weights / _weights.sum()
"""Of the mean over a normal variable (Gauss and Hermite)."""
UNKNOWN = 1e3
"""Times what the data so far say, at most: they say nothing then."""


def least_noise(fit: FittedModel, joint: int) -> float:
    """Deviation of the residual, N m, that independent samples would have: what the data so far show of the noise along one
    direction says little of it along that of another motion."""
    parts = [predicted[joint] for predicted in predict_sessions(fit, fit.entries)]
    samples = sum(int(part.moving.sum()) for part in parts)
    deviation = float(fit.fit.residual[joint]) / np.sqrt(max(fit.fit.rows[joint], 1))
    return float(deviation * np.sqrt(samples / min(independent_samples(parts), max(samples, 1))))


def noise_along(
    observation: Observation, joint: int, mine: Index, others: Index, values: Array, least: float
) -> float:
    """Deviation of the residual along what the other columns leave of an effect's torque, N m: from what blocks of time add to
    their product, neighbouring ones joined to longer ones; the least favourable length counts, and no less than `least`."""
    stacked = observation.stacked(joint)
    on_joint = np.isin(mine, observation.joint_columns[joint])
    effect, beside = observation.on_rows(joint, mine), observation.on_rows(joint, others)
    left = unfollowed(stacked.rows[:, effect] @ values[on_joint], stacked.rows[:, beside])
    residual = unfollowed(stacked.rows[:, -2], stacked.rows[:, np.concatenate([beside, effect])])
    power = float(left @ left)
    if power <= 0.0:
        return least
    sums = stacked.sums((left * residual)[:, None])
    noisy = [
        np.sum(part**2) * len(part) / max(len(part) - 1, 1)
        for part in joined_influences(sums, observation.sessions)
    ]
    return max(least, float(np.sqrt(max(noisy) / power)))


def unfollowed(torque: Array, columns: Array) -> Array:
    """What columns leave of a torque."""
    scale = np.linalg.norm(columns, axis=0)
    columns = columns[:, scale > 0] / scale[scale > 0]
    return np.asarray(torque - columns @ np.linalg.lstsq(columns, torque, rcond=1e-10)[0])


@dataclass(frozen=True)
class Apart:
    """How far two rivals part.

    separation : standard deviations of the noise
    further    : parameters that one has beyond the other, which is its special case; 0 where none is the other's
    so_far     : of these parameters, what the data so far give them, in standard deviations
    more       : times what the data so far say of them (one over the deviation) it is with the motion
    """

    separation: float
    further: int = 0
    so_far: float = 0.0
    more: float = 1.0

    @classmethod
    def of_a_wider(cls, so_far: float, more: float, further: int) -> "Apart":
        """Its separation is what its further parameters come to (root mean square) if it is right: they are known to one
        standard deviation so far."""
        return cls(float(np.sqrt((more * so_far) ** 2 + more**2 - 1.0)), further, so_far, more)


def expected_share(apart: Apart) -> float:
    """Part that the right one of two rivals is expected to have of the probability that the diagnosis gives both.

    Of two of which none contains the other the logarithm of the odds is normal: mean d²/2, variance d² by the noise, and
    d² by the bootstrap over stretches.

    No motion speaks for a special case but by what further parameters lose on unseen motion. With the statistic t of k
    of them the logarithm of the odds of the wider one has the mean t²/2 - k (Akaike 1973; cross-validation comes to the
    same, Stone 1977) and the variance t² by the bootstrap. Of t the data so far have d. With r times as much known t has
    the mean r d and the variance r² - 1 if the wider one is right, whose further parameters are known to one deviation,
    and d / r and 1 - 1/r² if its special case is.
    """
    if not apart.further:
        odds = 0.5 * apart.separation**2 + np.sqrt(2.0) * apart.separation * NODES
        return float(WEIGHTS @ _logistic(odds))
    known, more, further = apart.so_far, apart.more, apart.further
    wide = float(_share_of_the_wider(np.array([known]), further)[0])
    if_wide = _share_of_the_wider(more * known + np.sqrt(more**2 - 1.0) * NODES, further)
    if_narrow = 1.0 - _share_of_the_wider(known / more + np.sqrt(1.0 - more**-2.0) * NODES, further)
    return float(wide * (WEIGHTS @ if_wide) + (1.0 - wide) * (WEIGHTS @ if_narrow))


def _share_of_the_wider(statistic: Array, parameters: int) -> Array:
    """What the diagnosis gives a wider rival with these statistics of its first further parameter; the others have what noise
    gives."""
    square = statistic**2 + parameters - 1
    odds = (0.5 * square - parameters)[:, None] + np.sqrt(square)[:, None] * NODES
    return np.asarray(_logistic(odds) @ WEIGHTS)


def _logistic(odds: Array) -> Array:
    return np.asarray(1.0 / (1.0 + np.exp(-np.clip(odds, -700.0, 700.0))))
