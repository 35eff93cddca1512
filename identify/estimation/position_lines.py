"""Lines in what is left over position: ripple that repeats so many times per turn."""

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from identify.effects.motion import JointSummary
from identify.estimation.prediction import Prediction
from identify.signals import zero_phase

Array = NDArray[np.float64]

LINES = 6
"""strongest lines handed to the ripple effects, and at most so many wave numbers to either side of the strongest"""
FEWEST_CYCLES = 2.5
"""cycles over the range of motion below which a ripple cannot be told from a slow dependence on position"""
BINS_PER_CYCLE = 8
MOST_BINS = 1 << 16
EXPLAINS = 0.3
"""Part of what is left in the samples slow enough to show it with which a line counts wherever it stands."""
NEIGHBOURHOOD = 24
"""resolution cells to either side of a line that it must stand out from"""
MOST_PEAKS = 40
"""strongest peaks of an octave that are looked at"""
FEWEST_SAMPLES = 60
"""of full weight, in which a wave number can show"""
STANDS_OUT = 6.0
"""A line counts if its power is this many times the median of its neighbourhood; in noise one wave number in 60 does."""


@dataclass(frozen=True)
class PositionLines:
    """Wave numbers per rad (or m) that stand out, strongest first.

    torque   : in the residual itself, then what is near the strongest, then those of `gain` that are not among these
    gain     : in the residual in proportion to the torque, then the like: what differs in nothing but how the ripple grows
               with the torque is compared at the same places
    width    : of the strongest line, given the way that the samples slow enough to show it cover
    searched : independent wave numbers looked at
    """

    torque: tuple[float, ...] = ()
    gain: tuple[float, ...] = ()
    width: float = 0.0
    searched: int = 1


def position_lines(
    predictions: Sequence[Prediction], summary: JointSummary, decimation_cutoff: float
) -> PositionLines:
    """Search the residual of one joint over position.

    Of a ripple of wave number k the parallel filter leaves the part that it leaves of the frequency k |dq| / 2π, half at
    f_c; wave numbers that only the slowest twentieth of the samples could show are not looked at.
    """
    q = np.concatenate([part.position[part.moving] for part in predictions])
    speed = np.abs(np.concatenate([part.velocity[part.moving] for part in predictions]))
    residual = np.concatenate([part.residual[part.moving] for part in predictions])
    torque = np.concatenate([part.predicted[part.moving] for part in predictions])
    span = float(np.ptp(q)) if len(q) else 0.0
    slow = max(float(summary.speed_quantiles[2]), summary.speed_resolution, 1e-9)
    highest = 2 * np.pi * decimation_cutoff / slow
    if summary.position_resolution > 0:
        highest = min(highest, 0.25 * np.pi / summary.position_resolution)
    highest = min(highest, 2 * np.pi * MOST_BINS / BINS_PER_CYCLE / max(span, 1e-12))
    lowest = 2 * np.pi * FEWEST_CYCLES / max(span, 1e-12)
    if highest <= 2 * lowest or len(q) < FEWEST_SAMPLES:
        return PositionLines()
    plain: list[tuple[float, float]] = []
    weighted: list[tuple[float, float]] = []
    for low, high in _bands(lowest, highest):
        # What moves faster than this has lost all such ripples in the filter and would only add its noise.
        passed = speed * low < 2 * np.pi * decimation_cutoff
        left = _left_by_filter(np.sqrt(low * high) * speed[passed] / (2 * np.pi), decimation_cutoff)
        if left @ left < FEWEST_SAMPLES:
            break
        at, values, load = q[passed], residual[passed], torque[passed]
        for weight, peaks in ((left, plain), (left * load, weighted)):
            wave_numbers, explained = _explained(at, values, weight, high)
            peaks += _peaks(wave_numbers, explained, low, _covered(at, high), float(values @ values))
    searched = max(1, int(span * highest / (2 * np.pi)))
    lines, gains = _strongest(plain, span), _strongest(weighted, span)
    covered = span
    if lines:
        passed = speed * lines[0] < 2 * np.pi * decimation_cutoff
        covered = _covered(q[passed], lines[0]) or span
    width, cell = 2 * np.pi / covered, 2 * np.pi / span
    lines += _apart(_beside(lines, width, cell), lines, 0.5 * cell)
    return PositionLines(
        lines + _apart(gains, lines, cell), gains + _apart(lines, gains, cell), width, searched
    )


def _left_by_filter(frequency: Array, cutoff: float) -> Array:
    """Part of a frequency (Hz) that the parallel filter leaves; its gain where the sampling is much faster."""
    return np.asarray(1.0 / (1.0 + (frequency / cutoff) ** (2 * zero_phase.ORDER)))


def _beside(lines: Sequence[float], width: float, cell: float) -> tuple[float, ...]:
    """Wave numbers a resolution cell apart over the width of the strongest line, the nearest first.

    The fit knows more than the few slow samples that show a line: to it a wave number that is off by a cell is another.
    """
    steps = min(int(0.5 * width / cell), LINES)
    return (
        tuple(lines[0] + sign * step * cell for step in range(1, steps + 1) for sign in (-1, 1))
        if lines
        else ()
    )


def _apart(some: Sequence[float], others: Sequence[float], distance: float) -> tuple[float, ...]:
    """Those of some wave numbers that are further than this from all others."""
    return tuple(line for line in some if all(abs(line - other) > distance for other in others))


def _bands(lowest: float, highest: float) -> list[tuple[float, float]]:
    """Octaves of wave numbers, each with its own share of the samples."""
    edges = [lowest]
    while edges[-1] < highest:
        edges.append(min(2 * edges[-1], highest))
    return list(pairwise(edges))


def _covered(q: Array, highest: float) -> float:
    """Way that the samples cover, rad or m, gaps of more than half a wave left out; lines are as wide as 2π over it."""
    width = np.pi / highest
    return width * len(np.unique(np.floor(q / width)))


def _explained(q: Array, values: Array, weight: Array, highest: float) -> tuple[Array, Array]:
    """Part of the power of `values` that weight (a cos k q + b sin k q) explains by least squares, over k.

    The sums of the normal equations come from two FFTs of sums in fine bins of position (Press and Rybicki 1989); a
    plain spectrum would blur where the samples cover few waves or the weight changes its sign.
    """
    width = 2 * np.pi / highest / BINS_PER_CYCLE
    place = ((q - q.min()) / width).astype(np.intp)
    size = 2 ** int(np.ceil(np.log2(4 * (place.max() + 1))))
    wave_numbers = 2 * np.pi * np.arange(size // 2 + 1) / (size * width)
    kept = np.flatnonzero(wave_numbers <= highest * (1 + 1 / BINS_PER_CYCLE))
    kept = kept[2 * kept < len(wave_numbers)]
    first = np.fft.rfft(np.bincount(place, values * weight, size))[kept]
    double = np.fft.rfft(np.bincount(place, weight**2, size))[2 * kept]
    whole = float(weight @ weight)
    cosine, sine, mixed = 0.5 * (whole + double.real), 0.5 * (whole - double.real), -0.5 * double.imag
    determinant = cosine * sine - mixed**2
    seen = determinant > 1e-3 * whole**2
    power = first.real**2 * sine + first.imag**2 * cosine + 2 * first.real * first.imag * mixed
    share = np.where(seen, power / np.where(seen, determinant, 1.0), 0.0) / max(
        float(values @ values), 1e-300
    )
    return wave_numbers[kept], np.clip(share, 0.0, 1.0)


def _peaks(
    wave_numbers: Array, explained: Array, lowest: float, covered: float, power: float
) -> list[tuple[float, float]]:
    """Local maxima that stand out of their neighbourhood, or explain much: power and wave number."""
    cell = 2 * np.pi / covered
    spacing = wave_numbers[1] - wave_numbers[0]
    half = max(4, round(NEIGHBOURHOOD * cell / spacing))
    inner = np.arange(1, len(explained) - 1)
    at = explained[inner]
    maxima = inner[
        (wave_numbers[inner] >= lowest) & (at >= explained[inner - 1]) & (at >= explained[inner + 1])
    ]
    peaks = []
    for index in maxima[np.argsort(explained[maxima])[: -MOST_PEAKS - 1 : -1]]:
        usual = float(np.median(explained[max(0, index - half) : index + half + 1]))
        if explained[index] > min(STANDS_OUT * usual, EXPLAINS):
            peaks.append(index)
    return [(float(power * explained[index]), float(wave_numbers[index])) for index in peaks]


def _strongest(peaks: Sequence[tuple[float, float]], span: float) -> tuple[float, ...]:
    """Wave numbers of the strongest peaks.

    Two slow ways far apart show a line as fringes, which only the motion held out can tell apart: hence all that are
    further apart than a line over the whole range is wide.
    """
    chosen: list[float] = []
    for _, wave_number in sorted(peaks, reverse=True):
        chosen += _apart([wave_number], chosen, 2 * np.pi / span)
        if len(chosen) == LINES:
            break
    return tuple(chosen)
