"""How small the error can become: the part of the measurement that does not repeat when the motion does."""

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from identify.estimation.record import Record, Samples

Array = NDArray[np.float64]

FEWEST_REPEATS = 2
REPEAT_TOLERANCE = 0.02
"""Part of the range of motion by which repeats may differ (root mean square) and still count as the same
motion.
"""


def noise_floors(record: Record) -> list[float | None]:
    """For every joint the relative norm of what does not repeat; None where no motion repeats.

    Within a session whose motion is periodic, the torque at the same phase of different periods differs by
    noise only, whatever the model. With K periods the mean over periods takes away 1/K of the noise; the
    estimate is corrected for it.
    """
    residual = np.zeros(record.joints)
    measured = np.zeros(record.joints)
    found = np.zeros(record.joints, bool)
    for entry in record.entries():
        samples = record.samples[entry.file]
        period = repeat_period(samples)
        if period is None:
            continue
        scatter = phase_scatter(samples, period)
        for joint in range(record.joints):
            moving = samples.moving[:, joint]
            residual[joint] += scatter[joint] * moving.sum()
            measured[joint] += np.sum(samples.measured[moving, joint] ** 2)
            found[joint] = True
    return [
        float(np.sqrt(residual[joint] / measured[joint])) if found[joint] and measured[joint] > 0 else None
        for joint in range(record.joints)
    ]


def repeat_period(samples: Samples) -> float | None:
    """s: the period with which the motion of all joints repeats within a session, None where it does not.

    The period is the shortest lag at which the mean squared difference of all positions, each in units of
    its own range, has a minimum below the tolerance, the lag being fractional (parabola through the minimum).
    """
    count = len(samples.time)
    if count < 40:
        return None
    step = float(np.median(np.diff(samples.time)))
    if np.any(np.abs(np.diff(samples.time) - step) > 0.5 * step):
        return None
    scale = np.maximum(np.ptp(samples.q, axis=0), 1e-12)
    position = (samples.q - samples.q.mean(0)) / scale
    difference = _lag_difference(position)
    longest = count // FEWEST_REPEATS
    inner = np.arange(2, min(longest, count - 2) + 1)
    lowest = inner[
        (difference[inner] <= difference[inner - 1])
        & (difference[inner] <= difference[inner + 1])
        & (difference[inner] < (REPEAT_TOLERANCE**2))
    ]
    passed = np.flatnonzero(difference > 0.25 * np.var(position, axis=0).mean())
    if not len(passed):
        return None
    lowest = lowest[lowest > passed[0]]
    if not len(lowest):
        return None
    lag = int(lowest[0])
    left, middle, right = difference[lag - 1], difference[lag], difference[lag + 1]
    curvature = left - 2 * middle + right
    shift = 0.5 * (left - right) / curvature if curvature > 0 else 0.0
    return (lag + float(np.clip(shift, -0.5, 0.5))) * step


def _lag_difference(position: Array) -> Array:
    """Mean squared difference of (samples, joints) positions at every lag, worst joint, by FFT
    correlation.
    """
    count = len(position)
    size = 2 ** int(np.ceil(np.log2(2 * count)))
    worst = np.zeros(count)
    overlap = count - np.arange(count)
    for column in position.T:
        spectrum = np.fft.rfft(column, size)
        correlation = np.fft.irfft(spectrum * spectrum.conj(), size)[:count]
        squares = np.concatenate([[0.0], np.cumsum(column**2)])
        lead = squares[count - np.arange(count)]
        trail = squares[count] - squares[np.arange(count)]
        worst = np.maximum(worst, (lead + trail - 2 * correlation) / overlap)
    return np.maximum(worst, 0.0)


def phase_scatter(samples: Samples, period: float) -> Array:
    """(joints,): variance of the torque between periods at the same phase, N² m².

    The samples lie at other phases in each period; a cubic spline reads them at the same ones. The period is
    refined to where the positions scatter least, since torque steps punish a shift of a fraction of a sample.
    """
    from scipy.interpolate import CubicSpline
    from scipy.optimize import minimize_scalar

    step = float(np.median(np.diff(samples.time)))
    clock = samples.time - samples.time[0]
    position = CubicSpline(clock, samples.q / np.maximum(np.ptp(samples.q, axis=0), 1e-12))

    def scatter_of_position(candidate: float) -> float:
        return float(_scatter(position, clock[-1], candidate, step).sum())

    bounds = (period - step, period + step)
    # SciPy's stubs know the result only as a dictionary
    found = minimize_scalar(scatter_of_position, bounds=bounds, method="bounded", options={"xatol": 1e-6})
    period = float(found["x"])  # type: ignore[index]
    return _scatter(CubicSpline(clock, samples.measured), clock[-1], period, step)


def _scatter(course: Callable[[Array], Array], duration: float, period: float, step: float) -> Array:
    """Variance between periods at the same phase of a (samples, joints) course, mean over the phases."""
    phases = np.arange(0.0, period - 0.5 * step, step)
    squares, freedom = 0.0, 0
    whole = int(duration / period)
    rest = phases[phases + whole * period <= duration]
    for part, repeats in ((phases[: len(rest)], whole + 1), (phases[len(rest) :], whole)):
        if repeats >= FEWEST_REPEATS and len(part):
            stack = np.array([course(part + index * period) for index in range(repeats)])
            squares = squares + np.sum((stack - stack.mean(0)) ** 2, axis=(0, 1))
            freedom += (repeats - 1) * len(part)
    return np.asarray(squares) / max(freedom, 1)
