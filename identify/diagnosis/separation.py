"""How far two effects of a joint part, in the noise that the data show, and what the diagnosis then makes of it.

The noise is that along what the one cannot follow of the other, from the scores of blocks of time, as in the test by which the
diagnosis tells two effects apart (`evidence.py`), and no less than that of as many independent samples as the residual's memory
leaves. The probability is what the diagnosis gives the right one of the two (`probability.shares`): with separation d the
logarithm of their likelihoods differs by d²/2 with the variance d², and the bootstrap over stretches of the motion scatters it by
as much again.
"""

import numpy as np
from numpy.typing import NDArray

from identify.diagnosis.evidence import joined_influences
from identify.diagnosis.probability import independent_samples
from identify.estimation.fitted_model import FittedModel
from identify.estimation.observation import Observation
from identify.estimation.prediction import predict_sessions

Array = NDArray[np.float64]
Index = NDArray[np.intp]


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
        for part in joined_influences(sums, np.array([block.session for block in observation.blocks]))
    ]
    return max(least, float(np.sqrt(max(noisy) / power)))


def unfollowed(torque: Array, columns: Array) -> Array:
    """What columns leave of a torque."""
    scale = np.linalg.norm(columns, axis=0)
    columns = columns[:, scale > 0] / scale[scale > 0]
    return np.asarray(torque - columns @ np.linalg.lstsq(columns, torque, rcond=1e-10)[0])


def expected_share(separation: float) -> float:
    """Part that the right one of two rivals is expected to have of the probability that the diagnosis gives both.

    Its logarithm of the odds is normal: mean d²/2, variance d² by the noise, and d² by the bootstrap over stretches.
    """
    node, weight = np.polynomial.hermite_e.hermegauss(60)
    odds = 0.5 * separation**2 + np.sqrt(2.0) * separation * node
    return float(weight @ (1.0 / (1.0 + np.exp(-np.clip(odds, -700.0, 700.0)))) / weight.sum())
