"""What pictures of a residual are drawn from: its worst stretch, its waves over position, its correlation and distribution."""

from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]

BINS_PER_WAVE = 8
"""of the shortest wave that a spectrum over position shows"""
MOST_BINS = 1 << 13
FEWEST_PAIRS = 30
"""of samples as far apart as a lag: of fewer, white noise alone correlates to more than a third"""
NORMAL_95 = 1.96
"""standard deviations within which 95 % of a normal distribution lie"""


def worst_stretch(session: NDArray[np.integer], time: Array, error: Array, seconds: float) -> slice:
    """Rows of the stretch of one session, at most `seconds` long, whose error ‖ρ‖ is largest; empty where there are none.

    session, time, error : (N,); sessions follow one another, time increases within each, s
    """
    best, chosen = -1.0, slice(0, 0)
    power = np.concatenate([[0.0], np.cumsum(np.square(error))])
    for start, stop in _runs(session):
        begins = np.arange(start, stop)
        ends = start + np.searchsorted(time[start:stop], time[start:stop] + seconds, side="right")
        sums = power[ends] - power[begins]
        first = int(np.argmax(sums))
        if sums[first] > best:
            best, chosen = float(sums[first]), slice(int(begins[first]), int(ends[first]))
    return chosen


def _runs(session: NDArray[np.integer]) -> list[tuple[int, int]]:
    """Begin and end of each session's rows."""
    if not len(session):
        return []
    edges = [0, *(np.flatnonzero(np.diff(session)) + 1).tolist(), len(session)]
    return list(pairwise(edges))


def position_spectrum(position: Array, error: Array, wave_numbers: Array) -> Array:
    """(K,) amplitude of the error's wave at each wave number (K,), 1/rad or 1/m: 2 |mean of ρ e^(−i k q)|.

    Every part of the range counts alike, however long the joint was there: the error is averaged over position first.
    """
    low, high = float(position.min()), float(position.max())
    shortest = 2 * np.pi / float(wave_numbers.max())
    bins = int(np.clip(np.ceil((high - low) / shortest * BINS_PER_WAVE), 16, MOST_BINS))
    place = np.minimum(((position - low) / max(high - low, 1e-12) * bins).astype(int), bins - 1)
    count = np.bincount(place, minlength=bins)
    seen = count > 0
    mean = np.bincount(place, weights=error, minlength=bins)[seen] / count[seen]
    at = low + (np.flatnonzero(seen) + 0.5) * (high - low) / bins
    waves = np.exp(-1j * np.outer(wave_numbers, at))
    return np.asarray(2.0 * np.abs(waves @ (mean - mean.mean())) / len(mean), dtype=np.float64)


@dataclass(frozen=True)
class Correlation:
    """Autocorrelation of a residual.

    lag   : (L,) s
    value : (L,) 1 at lag 0; NaN where fewer than `FEWEST_PAIRS` samples are that far apart
    bound : what 95 % of the values of white noise stay within
    """

    lag: Array
    value: Array
    bound: float


def autocorrelation(
    session: NDArray[np.integer],
    time: Array,
    error: Array,
    longest: float,
    chosen: NDArray[np.bool_] | None = None,
) -> Correlation:
    """Of the error (N,) within sessions, up to a lag of `longest` s; samples are taken as evenly spaced, as they are but
    where a joint rests.

    chosen : (N,) only pairs of samples that are both chosen count; the error keeps the mean of all, so that a model that is
             wrong in one place correlates with itself there. None: all.
    """
    period = float(np.median(np.diff(time))) if len(time) > 1 else 1.0
    lags = int(np.clip(longest / max(period, 1e-9), 1, max(1, len(error) // 4)))
    counts = np.ones(len(error)) if chosen is None else chosen.astype(np.float64)
    centred = (error - error.mean()) * counts if len(error) else error
    sums, pairs = np.zeros(lags + 1), np.zeros(lags + 1)
    for start, stop in _runs(session):
        part = counts[start:stop]
        if not part.any():
            continue
        shown = min(lags + 1, len(part))
        sums[:shown] += _products(centred[start:stop], lags)[:shown]
        pairs[:shown] += (
            len(part) - np.arange(shown) if chosen is None else np.rint(_products(part, lags)[:shown])
        )
    enough = (pairs >= min(FEWEST_PAIRS, pairs[0])) & (pairs > 0)
    value = np.full(lags + 1, np.nan)
    if sums[0] > 0:
        value[enough] = sums[enough] / pairs[enough] * (pairs[0] / sums[0])
    bound = NORMAL_95 / np.sqrt(max(int(counts.sum()), 1))
    return Correlation(period * np.arange(lags + 1, dtype=np.float64), value, bound)


def _products(values: Array, lags: int) -> Array:
    """(≥ min(lags + 1, N),) sums of the products of values (N,) 0, 1, … apart."""
    size = 1 << int(len(values) + min(lags, len(values)) - 1).bit_length()
    return np.fft.irfft(np.square(np.abs(np.fft.rfft(values, size))), size)


@dataclass(frozen=True)
class Distribution:
    """Histogram of a residual beside the normal distribution of the same mean and deviation.

    edges  : (B + 1,) in the unit of the error
    share  : (B,) of the samples in each interval
    normal : (B,) of a normal distribution there
    bounds : the 2.5th and the 97.5th percentile
    """

    edges: Array
    share: Array
    normal: Array
    bounds: tuple[float, float]


def distribution(error: Array, intervals: int = 41) -> Distribution:
    """Of the error (N,), over four deviations to either side; all zero where there are no samples."""
    if not len(error):
        nothing = np.zeros(intervals)
        return Distribution(np.linspace(-4.0, 4.0, intervals + 1), nothing, nothing, (0.0, 0.0))
    mean, deviation = float(error.mean()), float(error.std()) or 1.0
    edges = mean + deviation * np.linspace(-4.0, 4.0, intervals + 1)
    share = np.histogram(error, edges)[0] / max(len(error), 1)
    middle = (edges[:-1] + edges[1:]) / 2
    normal = np.exp(-0.5 * np.square((middle - mean) / deviation)) / (deviation * np.sqrt(2 * np.pi))
    low, high = np.quantile(error, [0.025, 0.975])
    return Distribution(edges, share, normal * (edges[1] - edges[0]), (float(low), float(high)))


def around_reversals(
    session: NDArray[np.integer],
    time: Array,
    velocity: Array,
    columns: Array,
    half_width: float,
    intervals: int = 48,
    moving: NDArray[np.bool_] | None = None,
) -> tuple[Array, Array, Array]:
    """What signals do around reversals of a joint, on the average: instants (B,) s after the reversal, means (K, B), and the
    share of the samples (B,) in which the joint moves.

    columns    : (K, N) signals, each turned by the direction after the reversal, so that both kinds of reversal add up
    half_width : s before and after
    moving     : (N,) samples in which the joint moves; all where None. A joint that rests between two directions turns in the
                 middle of its rest; one that rests longer than `half_width` stopped, and is left out where others turn
    Samples belong to the nearest reversal of their session; an interval in which there are none is NaN.
    """
    apart = float(np.ptp(time) + 10.0 * half_width + 1.0) if len(time) else 1.0
    clock = time + session * apart
    rows = np.arange(len(time)) if moving is None else np.flatnonzero(moving)
    turned_at = (np.diff(np.sign(velocity[rows])) != 0) & (np.diff(session[rows]) == 0)
    before, turns = rows[:-1][turned_at], rows[1:][turned_at]
    brief = clock[turns] - clock[before] <= half_width
    if brief.any():
        before, turns = before[brief], turns[brief]
    edges = np.linspace(-half_width, half_width, intervals + 1)
    middle = (edges[:-1] + edges[1:]) / 2
    if not len(turns):
        return middle, np.full((len(columns), intervals), np.nan), np.full(intervals, np.nan)
    instants = (clock[turns] + clock[before]) / 2
    after = (
        np.clip(np.searchsorted(instants, clock), 1, len(turns) - 1)
        if len(turns) > 1
        else np.zeros(len(clock), int)
    )
    nearest = after - (clock - instants[after - 1] < instants[after] - clock) if len(turns) > 1 else after
    since = clock - instants[nearest]
    place = np.searchsorted(edges, since, side="right") - 1
    inside = (place >= 0) & (place < intervals)
    count = np.bincount(place[inside], minlength=intervals)
    turned = columns * np.sign(velocity[turns])[nearest]
    signals = [*turned, np.ones(len(clock)) if moving is None else moving.astype(float)]
    with np.errstate(invalid="ignore", divide="ignore"):
        means = [
            np.bincount(place[inside], weights=row[inside], minlength=intervals) / count for row in signals
        ]
    return middle, np.array(means[:-1]), means[-1]
