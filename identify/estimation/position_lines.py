"""Lines in what is left over position: ripple that repeats so many times per turn."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from identify.effects.motion import JointSummary
from identify.estimation.prediction import Prediction

Array = NDArray[np.float64]

LINES = 4
"""strongest lines handed to the ripple effects"""
FEWEST_CYCLES = 1.5
"""cycles over the range of motion below which a ripple cannot be told from a slow dependence on position"""
BINS_PER_CYCLE = 8
MOST_BINS = 1 << 16
STANDS_OUT = 6.0
"""A line counts if its power is this many times the median of its neighbourhood; in noise one wave number in 60 does."""


@dataclass(frozen=True)
class PositionLines:
    """Wave numbers per rad (or m) that stand out, strongest first.

    torque   : in the residual itself
    gain     : in the residual in proportion to the torque
    searched : independent wave numbers looked at
    """

    torque: tuple[float, ...]
    gain: tuple[float, ...]
    searched: int


def position_lines(
    predictions: Sequence[Prediction], summary: JointSummary, decimation_cutoff: float
) -> PositionLines:
    """Search the residual of one joint over position.

    A ripple of wave number k passes the parallel filter while k |dq| < 2π f_c; wave numbers that only the slowest
    twentieth of the samples could show are not looked at.
    """
    q = np.concatenate([part.position[part.moving] for part in predictions])
    residual = np.concatenate([part.residual[part.moving] for part in predictions])
    torque = np.concatenate([part.predicted[part.moving] for part in predictions])
    span = float(np.ptp(q)) if len(q) else 0.0
    slow = max(float(summary.speed_quantiles[2]), summary.speed_resolution, 1e-9)
    highest = 2 * np.pi * decimation_cutoff / slow
    if summary.position_resolution > 0:
        highest = min(highest, 0.25 * np.pi / summary.position_resolution)
    highest = min(highest, 2 * np.pi * MOST_BINS / BINS_PER_CYCLE / max(span, 1e-12))
    lowest = 2 * np.pi * FEWEST_CYCLES / max(span, 1e-12)
    if highest <= 2 * lowest or len(q) < 100:
        return PositionLines((), (), 1)
    wave_numbers, plain, weighted = _spectra(q, residual, torque, highest)
    searched = max(1, int(span * highest / (2 * np.pi)))
    return PositionLines(
        _peaks(wave_numbers, plain, lowest, span), _peaks(wave_numbers, weighted, lowest, span), searched
    )


def _spectra(q: Array, residual: Array, torque: Array, highest: float) -> tuple[Array, Array, Array]:
    """Power of residual and of residual times torque over wave number, by FFT of sums in fine bins of position."""
    width = 2 * np.pi / highest / BINS_PER_CYCLE
    place = ((q - q.min()) / width).astype(np.intp)
    size = 2 ** int(np.ceil(np.log2(4 * (place.max() + 1))))
    wave_numbers = 2 * np.pi * np.arange(size // 2 + 1) / (size * width)
    kept = wave_numbers <= highest
    plain, weighted = (
        np.abs(np.fft.rfft(np.bincount(place, values, size))) ** 2 for values in (residual, residual * torque)
    )
    return wave_numbers[kept], plain[kept], weighted[kept]


def _peaks(wave_numbers: Array, power: Array, lowest: float, span: float) -> tuple[float, ...]:
    """The strongest local maxima that stand out of their neighbourhood, one resolution cell apart."""
    cell = 2 * np.pi / span
    spacing = wave_numbers[1] - wave_numbers[0]
    half = max(4, round(12 * cell / spacing))
    local = np.array(
        [np.median(power[max(0, index - half) : index + half + 1]) for index in range(len(power))]
    )
    ratio = power / np.maximum(local, 1e-300)
    inner = np.arange(1, len(power) - 1)
    candidates = inner[
        (wave_numbers[inner] >= lowest)
        & (power[inner] >= power[inner - 1])
        & (power[inner] >= power[inner + 1])
        & (ratio[inner] > STANDS_OUT)
    ]
    chosen: list[float] = []
    for index in candidates[np.argsort(power[candidates])[::-1]]:
        if all(abs(wave_numbers[index] - other) > cell for other in chosen):
            chosen.append(float(wave_numbers[index]))
        if len(chosen) == LINES:
            break
    return tuple(chosen)
