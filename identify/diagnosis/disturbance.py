"""What comes and goes without regard to the motion: disturbances, told from noise by their memory and their strength.

Noise of an amplifier, a filter or a current sensor forgets itself within a few tenths of a second, and it is small
beside the torque. What a hand, a cable, a brake or the wind does to a joint lasts longer, or is far stronger than
the noise is at any other time. Hence three questions, none of which knows the motion's repeats or a model:

- Can what is left be predicted from itself before and after, nearer samples than `NOISE_MEMORY` not counted (`time`)?
- The same for what is left in the direction of motion (`time`, `direction`): something that drags.
- Is much of its power in a few runs that stand out of the noise, away from reversals (`moments`)?

Where what is left is more than `LOUD` of the torque, no amplifier explains it, and samples count from `NOISE_TIME` on.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from identify.diagnosis.deciding_constants import (
    LEAST_SHARE,
    LOUD,
    NOISE_MEMORY,
    NOISE_TIME,
    STANDS_OUT,
    STRETCHES,
)
from identify.estimation.prediction import Prediction

Array = NDArray[np.float64]

BIN = 0.1
"""s whose mean is predicted from the means of others; faster noise averages out"""
FILTER_MEMORY = 4
"""samples at the decimated rate over which the parallel filter correlates its output"""
REACH = 1.5
"""s before and after from which is predicted"""
RIDGE = 1e-2
INDEPENDENT = 5
"""bins (0.5 s) whose agreement with their prediction counts as one piece of evidence"""
FEWEST_BINS = 60
TURNING = 0.15
"""s around a reversal or a stop in which friction that turns round late or early is no disturbance"""


@dataclass(frozen=True)
class PredictableShare:
    """Part of the residual's power, and its standard error."""

    share: float
    deviation: float


NOTHING = PredictableShare(0.0, np.inf)


def least_remembered() -> float:
    """Part of the residual's power that must be predicted from itself before it is no noise.

    Of noise with the correlation time `NOISE_TIME` a sample before and one after, with the correlation ρ each, predict
    2ρ²/(1 + ρ²); from `NOISE_MEMORY` on that is a tenth.
    """
    correlation = np.exp(-NOISE_MEMORY / NOISE_TIME)
    return float(LEAST_SHARE + 2 * correlation**2 / (1 + correlation**2))


def remembered(predictions: Sequence[Prediction], with_direction: bool = False) -> PredictableShare:
    """How much of the residual is predicted by itself, some tenths of a second before and after.

    Linear prediction of means over `BIN` from the sums of those at equal times before and after, with coefficients
    from other stretches of the motion (`STRETCHES`). The standard error is that of the agreement between mean and
    prediction over stretches of `INDEPENDENT` bins, of which a few strong ones can then not speak for all.

    with_direction : whether it is the residual in the direction of motion
    """
    width, lags = _bins_and_lags(predictions)
    tables, values, counts, folds, blocks = [], [], [], [], []
    so_far = 0
    for part in predictions:
        mean, count = _means(part, width, with_direction)
        bins, reach = len(mean), int(lags[-1])
        padded = np.concatenate([np.zeros(reach), mean, np.zeros(reach)])
        both = [
            padded[reach - lag : reach - lag + bins] + padded[reach + lag : reach + lag + bins]
            for lag in lags
        ]
        known = np.flatnonzero(count)
        tables.append(np.column_stack(both)[known])
        values.append(mean[known])
        counts.append(count[known])
        folds.append(known * STRETCHES // bins)
        blocks.append(known // INDEPENDENT + so_far)
        so_far += bins // INDEPENDENT + 1
    table, value, count = np.concatenate(tables), np.concatenate(values), np.concatenate(counts)
    fold, block = np.concatenate(folds), np.concatenate(blocks)
    power = sum(float(np.sum(part.residual[part.moving] ** 2)) for part in predictions)
    if len(value) < FEWEST_BINS or power <= 0:
        return NOTHING
    weighted = table * count[:, None]
    guess = np.zeros(len(value))
    for index in range(STRETCHES):
        train = fold != index
        inner = weighted[train].T @ table[train]
        inner[np.diag_indices(len(inner))] += max(RIDGE * float(np.trace(inner)) / len(inner), 1e-300)
        guess[~train] = table[~train] @ np.linalg.solve(inner, weighted[train].T @ value[train])
    share = float(count @ (value**2 - (value - guess) ** 2)) / power
    agreement = np.bincount(block, count * value * guess)
    common = float(agreement.sum())
    if common <= 0 or share <= 0:
        return PredictableShare(share, np.inf)
    return PredictableShare(share, share * float(np.sqrt(agreement @ agreement)) / common)


def strong_runs(predictions: Sequence[Prediction]) -> PredictableShare:
    """How much of the residual's power is in runs that stand out of the noise, away from reversals and stops."""
    smooth, quiet, total = [], [], 0.0
    for part in predictions:
        step = _step(part)
        turning = (np.diff(np.sign(part.velocity), prepend=0.0) != 0) | ~part.moving
        near = _within(turning, max(1, round(TURNING / step)))
        wide = max(1, round(BIN / step))
        smooth.append(np.convolve(np.where(near, 0.0, part.residual), np.ones(wide) / wide, "same"))
        quiet.append(~near)
        total += float(np.sum(part.residual[part.moving] ** 2))
    usual = np.concatenate([values[kept] for values, kept in zip(smooth, quiet, strict=True)])
    if len(usual) < FEWEST_BINS or total <= 0:
        return NOTHING
    deviation = 1.4826 * float(np.median(np.abs(usual)))
    bound = STANDS_OUT * deviation
    power, samples = 0.0, 0
    for part, values, kept in zip(predictions, smooth, quiet, strict=True):
        out = np.concatenate([[False], (np.abs(values) > bound) & kept, [False]])
        edges = np.flatnonzero(out[1:] != out[:-1])
        for first, last in zip(edges[::2], edges[1::2], strict=True):
            if (last - first) * _step(part) >= BIN:  # longer than a sample or two
                power += float(np.sum(values[first:last] ** 2))
                samples += int(last - first)
    return PredictableShare(power / total, np.sqrt(2 * samples) * deviation**2 / total)


def _step(part: Prediction) -> float:
    return float(np.median(np.diff(part.time)))


def _bins_and_lags(predictions: Sequence[Prediction]) -> tuple[float, NDArray[np.intp]]:
    """Width of a bin in s, and the distances in bins from which is predicted."""
    step = max(_step(part) for part in predictions)
    width = max(BIN, 2 * step)
    residual = sum(float(np.sum(part.residual[part.moving] ** 2)) for part in predictions)
    measured = sum(float(np.sum(part.measured[part.moving] ** 2)) for part in predictions)
    memory = NOISE_TIME if residual > LOUD**2 * measured else NOISE_MEMORY
    nearest = int(np.ceil(max(memory, FILTER_MEMORY * step) / width - 1e-9))
    return width, np.arange(nearest, max(nearest + 1, round(REACH / width)) + 1)


def _means(part: Prediction, width: float, with_direction: bool) -> tuple[Array, Array]:
    """Mean residual of every bin, 0 where the joint moves in less than half of it, and samples that count there."""
    place = ((part.time - part.time[0]) / width).astype(int)
    value = np.where(part.moving, part.residual, 0.0)
    if with_direction:
        value = value * np.sign(part.velocity)
    count = np.bincount(place, part.moving).astype(float)
    whole = float(np.median(np.bincount(place)))
    count[count < 0.5 * whole] = 0
    return np.where(count > 0, np.bincount(place, value) / np.maximum(count, 1), 0.0), count


def _within(marked: NDArray[np.bool_], samples: int) -> NDArray[np.bool_]:
    """What lies within some samples of a mark."""
    from scipy.ndimage import maximum_filter1d

    return np.asarray(maximum_filter1d(marked.astype(np.uint8), 2 * samples + 1), bool)
