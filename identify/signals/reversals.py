"""When a joint turns round, as exactly as the recorded positions say.

Dry friction steps where the velocity changes its sign. The low-passed velocity changes it at another instant where
the joint brakes harder than it sets off again, or sticks for some milliseconds: friction helps to brake and hinders
to set off, so that this error is alike at all reversals, and looks like a delay of the command or like presliding.

Around each reversal of the low-passed velocity the positions as recorded are therefore compared with courses that
turn otherwise: a cubic on either side of a stop, for many instants of arrival and lengths of the stop, beside one
smooth course. Each course counts by how well it fits, in view of the noise and the rounding of the encoder (Bayes);
the instant is their mean. A smooth reversal, or positions too coarse to tell, leave it where the low-passed
velocity has it.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]

WINDOW = 0.45
"""Periods of the position cut-off to either side that are looked at."""
EARLIEST, LATEST = -0.3, 0.25
"""Periods of the cut-off, about the low-passed reversal: between them the joint arrives and sets off again."""
FEWEST = 5
"""Samples on either side, at least."""
ARRIVALS, STOPS = 23, 9
"""Instants of arrival and lengths of the stop that are tried."""
USUAL = 0.08
"""Periods of the cut-off: how far, before the positions are looked at, the instant is expected from the low-passed
one (a joint that sets off from friction alone turns at most 1/pi^2 away), and how long a stop."""
SMOOTH = 10.0
"""How much likelier than all others together the smooth course is held before the positions are looked at: an instant
that is moved without need is worse than one that is not, since most reversals are smooth."""
CUBIC = 0.01
"""Periods of the cut-off: deviation of an instant found beside a corner, whose sides are not exactly cubics."""
TURNS_WITHIN_STOP = 0.25
"""Of a stop: where in it friction steps. Held at rest, friction follows the torque, from what is left when the
joint arrives to the whole breakaway torque; its mean is that of a step between the arrival and half of the stop."""
SPREAD_WITHIN_STOP = 0.144
"""Of a stop: deviation of that instant, evenly spread over the first half."""


@dataclass(frozen=True, eq=False)
class Reversals:
    """Reversals of one joint in a stretch of samples.

    crossing  : (R,) where the low-passed velocity changes its sign, in samples
    instant   : (R,) where the joint turns, in samples
    deviation : (R,) of the instant, in samples
    heading   : (R,) sign of the velocity afterwards
    """

    crossing: Array
    instant: Array
    deviation: Array
    heading: Array

    def in_rows(self, first: int, stride: int) -> Reversals:
        """The same, counted in rows: every `stride`-th sample from `first`."""
        crossing, instant = (self.crossing - first) / stride, (self.instant - first) / stride
        return Reversals(crossing, instant, self.deviation / stride, self.heading)


def find_reversals(
    position: Array, velocity: Array, cutoff: float, sampling_period: float, rounding: float
) -> Reversals:
    """Reversals of one joint that stand alone: no other one near, and not at an end of the stretch.

    position : (N,) as recorded; velocity : (N,) of the positions low-passed at `cutoff`, Hz
    rounding : step of the encoder, or of the rounding that would scatter the positions alike
    """
    unit = 1.0 / (cutoff * sampling_period)
    half = max(FEWEST, round(WINDOW * unit))
    crossing, heading = _crossings(velocity)
    gap = np.diff(crossing, prepend=-np.inf, append=np.inf)
    alone = (gap[:-1] > 2 * half) & (gap[1:] > 2 * half)
    inside = (crossing >= half + 1) & (crossing <= len(position) - half - 2)
    crossing, heading = crossing[alone & inside], heading[alone & inside]
    if not len(crossing):
        return Reversals(crossing, crossing, crossing, heading)
    centre = np.round(crossing).astype(int)
    around = position[centre[:, None] + np.arange(-half, half + 1)]
    offset, deviation = _instants(around, crossing - centre, max(unit, 2.0 * FEWEST), rounding)
    return Reversals(crossing, centre + offset, deviation, heading)


def direction_of_motion(velocity: Array, reversals: Sequence[Reversals]) -> Array:
    """(N, n) sign of a low-passed velocity (N, n), but turning at the instants of the reversals.

    Near a reversal it is the direction to be expected at the instant of the row, for an instant of reversal that is
    spread evenly with its deviation.
    """
    direction = np.sign(velocity)
    for joint, turns in enumerate(reversals):
        spread = np.maximum(np.sqrt(3.0) * turns.deviation, 1e-9)
        early = np.floor(np.minimum(turns.crossing, turns.instant - spread)).astype(int)
        late = np.ceil(np.maximum(turns.crossing, turns.instant + spread)).astype(int)
        for number in range(len(turns.crossing)):
            rows = np.arange(max(early[number], 0), min(late[number] + 1, len(direction)))
            passed = np.clip((rows - turns.instant[number]) / spread[number], -1.0, 1.0)
            direction[rows, joint] = turns.heading[number] * passed
    return direction


def _crossings(velocity: Array) -> tuple[Array, Array]:
    """(R,) where a velocity changes its sign, in samples, by a straight line between two; its sign afterwards."""
    moving = np.flatnonzero(velocity)
    before, after = moving[:-1], moving[1:]
    turns = velocity[before] * velocity[after] < 0
    before, after = before[turns], after[turns]
    crossing = before + (after - before) * velocity[before] / (velocity[before] - velocity[after])
    return crossing, np.sign(velocity[after])


def _instants(around: Array, crossing: Array, unit: float, rounding: float) -> tuple[Array, Array]:
    """(R,) instants and deviations, samples from the middle, of windows (R, samples)."""
    half = around.shape[1] // 2
    bases, arrival, stop = _courses(half, unit)
    level = around - around[:, half : half + 1]
    courses, samples, columns = bases.shape
    parts = level @ bases.transpose(1, 0, 2).reshape(
        samples, -1
    )  # one product: einsum takes five times as long
    parts = parts.reshape(len(level), courses, columns)
    misfit = np.maximum(np.sum(level**2, axis=1)[:, None] - np.sum(parts**2, axis=2), 0.0)
    variance = np.maximum(rounding**2 / 12.0, misfit.min(axis=1) / max(1, samples - 7))
    # The roundings of samples that lie on one count are one error, not many.
    counts = np.abs(np.diff(around, axis=1)).sum(axis=1) / np.maximum(rounding, 1e-300)
    independent = np.clip(counts / samples, 1.0 / samples, 1.0)
    turn = arrival + TURNS_WITHIN_STOP * stop
    instant = np.column_stack([np.tile(turn, (len(around), 1)), crossing])
    expected = -0.5 * ((turn - crossing[:, None]) / (USUAL * unit)) ** 2 - stop / (USUAL * unit)
    expected -= np.log(np.sum(np.exp(expected), axis=1, keepdims=True))
    logarithm = np.column_stack([expected, np.full(len(around), np.log(SMOOTH))])
    logarithm -= 0.5 * misfit * (independent / np.maximum(variance, 1e-300))[:, None]
    weight = np.exp(logarithm - logarithm.max(axis=1, keepdims=True))
    weight /= weight.sum(axis=1, keepdims=True)
    mean = np.sum(weight * instant, axis=1)
    spread = np.append(np.hypot(SPREAD_WITHIN_STOP * stop, CUBIC * unit), 0.0) ** 2
    return mean, np.sqrt(np.sum(weight * ((instant - mean[:, None]) ** 2 + spread), axis=1))


@lru_cache(maxsize=16)
def _courses(half: int, unit: float) -> tuple[Array, Array, Array]:
    """Orthonormal bases (K + 1, samples, 5) of K courses that stop and of the smooth one; arrival and length (K,)."""
    time = np.arange(-half, half + 1, dtype=float)
    arrivals = unit * np.linspace(EARLIEST, LATEST, ARRIVALS)
    stops = unit * (LATEST - EARLIEST) * np.linspace(0.0, 1.0, STOPS) ** 2
    arrival, stop = (values.ravel() for values in np.meshgrid(arrivals, stops))
    possible = arrival + stop <= LATEST * unit + 1e-9
    arrival, stop = arrival[possible], stop[possible]
    left = np.maximum(arrival[:, None] - time, 0.0) / half
    right = np.maximum(time - (arrival + stop)[:, None], 0.0) / half
    columns = np.stack([np.ones_like(left), left**2, left**3, right**2, right**3], axis=2)
    smooth = (time[:, None] / half) ** np.arange(5)
    bases = np.linalg.qr(np.concatenate([columns, smooth[None]]))[0]
    return bases, arrival, stop
