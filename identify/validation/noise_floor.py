"""How small the error can become: the part of what a model leaves that does not repeat when the motion does."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from identify.estimation.record import Record, Samples
from identify.recording.quantiles import median

Array = NDArray[np.float64]

FEWEST_REPEATS = 2
SHORTEST_RUN = 0.6
"""Part of a period that must come again; trimmed edges may have cut the rest."""
COARSE_TOLERANCE = 0.03
"""Part of the range of motion by which repeats may differ at the instants looked at, a fraction of which they may miss."""
REPEAT_TOLERANCE = 0.003
"""The same (root mean square) at the refined period: what differs more is another motion, not noise."""
SPEED_TOLERANCE = 0.05
"""Part of the usual speed by which repeats may differ (root mean square). A slow way there and back passes about the same
places again at other times; its friction turns round elsewhere, which is not noise."""
LEAST_COVERED = 0.2
"""Part of a session that its repeated stretch must cover to speak for all of it."""
TURNING = 3
"""samples to either side of a reversal that do not count"""
STRETCHES = 20
"""of the phase, whose scatter gives the interval of a floor"""
FEWEST_PHASES = 100
"""degrees of freedom behind a joint's noise floor"""
MOST_ANSWERED = 0.5
"""Part of the acceleration's power that may differ between repeats: with more, the motion is mostly the noise's."""
MOST_STEPS = 20
"""windows by which a lag is followed to where the repeats differ least"""
LOOKED_AT = 800
"""Instants of a session at which repetition is looked for; the period is refined afterwards on all samples."""
SHORTEST_PERIOD = 12
"""of these instants; a shorter one is no motion that a period could be read from"""
MOST_TRIED = 60
"""lags that are refined and checked, those that cover the most first"""
ENOUGH_MOTION = 0.15
"""Part of the range of motion that a repeated stretch must cover; standing still repeats trivially."""


@dataclass(frozen=True)
class NoiseFloor:
    """Relative norm of what does not repeat when the motion does, and the interval (95 %) that repeats leave open.

    value : part of the measured torque
    """

    value: float
    low: float
    high: float


def noise_floors(record: Record, residuals: Mapping[str, Array]) -> list[NoiseFloor | None]:
    """For every joint the relative norm of what does not repeat; None where no motion repeats.

    residuals : by file of the sessions of the fit (samples, joints), what a fitted model leaves of the torque, N m or N

    Where a session, or a stretch of it, repeats its motion, what a model leaves at the same phase of different periods
    differs by noise only: whatever the model cannot say comes again. Of the torque itself that holds only where the motion
    comes again exactly. In closed loop it answers every disturbance, and the torques of two repeats differ by what the
    controller made of it as well; the model takes the difference of the motions into account. With K periods the mean over
    periods takes away 1/K of the noise; the estimate is corrected for it. Sessions whose motion does not repeat are taken to have
    the noise of those that do, so that the floor is a part of the torque of all of them, as the model's own error is. It is no
    higher than that error, which holds the noise too.

    The interval is that of the scatter between stretches of the phase, each of them independent of the others. In a soft
    loop its upper end is higher: where the acceleration answers the noise n, least squares takes a part ρ² of the power of n
    for inertia, ρ being the correlation of n with the whole acceleration. Only what differs between repeats can be correlated
    with it, so that ρ² is at most the part s of the acceleration's power that does not repeat (Cauchy, Schwarz), and the
    power of n at most 1/(1 − s) times what is left. Where most of the acceleration does not repeat there is no floor.
    """
    count = record.joints
    noise, measured, left = np.zeros(count), np.zeros(count), np.zeros(count)
    variance, answer, acceleration = np.zeros(count), np.zeros(count), np.zeros(count)
    behind, moved = np.zeros(count), np.zeros(count)
    for entry in record.entries():
        samples = record.samples[entry.file]
        residual = residuals[entry.file]
        measured += np.sum(np.where(samples.moving, samples.measured, 0.0) ** 2, axis=0)
        left += np.sum(np.where(samples.moving, residual, 0.0) ** 2, axis=0)
        moved += samples.moving.sum(0)
        stretch = repeated_stretch(samples)
        if stretch is None:
            continue
        repeat, period = stretch
        first = int(np.searchsorted(samples.time, repeat.time[0]))
        part = residual[first : first + len(repeat.time)]
        both = replace(repeat, measured=np.hstack([part, repeat.ddq]))
        squares, freedom = phase_scatter(both, period)
        unsteady = squares[:, count:].sum(0) / np.maximum(freedom[:, count:].sum(0), 1)
        squares, freedom = squares[:, :count], freedom[:, :count]
        whole = freedom.sum(0)
        for joint in np.flatnonzero(whole > FEWEST_PHASES):
            weight = int(samples.moving[:, joint].sum())
            scatter = squares[:, joint].sum() / whole[joint]
            stretches = len(squares)
            apart = squares[:, joint] - scatter * freedom[:, joint]
            deviation = np.sqrt(stretches / (stretches - 1) * float(apart @ apart)) / whole[joint]
            noise[joint] += scatter * weight
            variance[joint] += (deviation * weight) ** 2
            behind[joint] += weight
            answer[joint] += unsteady[joint] * len(repeat.time)
            acceleration[joint] += np.sum(repeat.ddq[:, joint] ** 2)
    repeats = behind > 0
    of_all = moved / np.maximum(behind, 1)
    noise, variance = noise * of_all, variance * of_all**2
    known = repeats & (measured > 0) & (answer <= MOST_ANSWERED * acceleration)
    answered = answer / np.where(acceleration > 0, acceleration, 1.0)
    return [
        _floor(noise[joint], variance[joint], left[joint], measured[joint], answered[joint])
        if known[joint]
        else None
        for joint in range(count)
    ]


def _floor(noise: float, variance: float, left: float, measured: float, answered: float) -> NoiseFloor:
    """From sums of squares; the interval from Student's quantile on the logarithm, which keeps it above zero.

    answered : part of the acceleration's power that does not repeat
    """
    from scipy.special import stdtrit

    spread = float(stdtrit(STRETCHES - 1, 0.975)) * float(np.sqrt(variance)) / max(noise, 1e-300)
    power = min(noise, left)
    low, high = noise * np.exp(-spread), noise * np.exp(spread) / (1 - answered)
    value, low, high = (
        float(np.sqrt(each / measured)) for each in (power, min(low, power), max(high, power))
    )
    return NoiseFloor(value, low, high)


def repeated_stretch(samples: Samples) -> tuple[Samples, float] | None:
    """The longest stretch of a session in which the motion of all joints repeats, and its period in s.

    For every lag the longest run of instants is found at which all positions, a lag later, are about the same. Of the
    lags that cover the most, the shortest at which they are the same once the lag is refined is the period.
    """
    count = len(samples.time)
    if count < 4 * SHORTEST_PERIOD:
        return None
    step = median(np.diff(samples.time))
    if np.any(np.abs(np.diff(samples.time) - step) > 0.5 * step):
        return None
    stride = max(1, count // LOOKED_AT)
    scale = np.maximum(np.ptp(samples.q, axis=0), 1e-12)
    speed = np.maximum(np.sqrt(np.mean(samples.dq**2, axis=0)), 1e-12)
    position = samples.q[::stride] / scale
    runs: list[tuple[int, int, int]] = []
    for lag in range(SHORTEST_PERIOD, int(len(position) / (1 + SHORTEST_RUN)) + 1):
        same = np.all(np.abs(position[lag:] - position[:-lag]) < COARSE_TOLERANCE, axis=1)
        start, length = _longest_run(same)
        if (
            length >= SHORTEST_RUN * lag
            and length + lag >= LEAST_COVERED * len(position)
            and np.ptp(position[start : start + lag], axis=0).max() > ENOUGH_MOTION
        ):
            runs.append((length + lag, lag, start))
    longest = max((covered for covered, _, _ in runs), default=0)
    for covered, lag, start in sorted(runs, key=lambda row: (row[0] < 0.8 * longest, row[1]))[:MOST_TRIED]:
        rows = slice(start * stride, min((start + covered) * stride, count))
        cut = _cut(samples, rows)
        period, difference = _nearest_lag(cut.q / scale, lag * stride, stride)
        if difference < REPEAT_TOLERANCE and _speeds_differ(cut.dq / speed, period) < SPEED_TOLERANCE:
            return cut, period * step
    return None


def _cut(samples: Samples, rows: slice) -> Samples:
    """Some rows of a session."""
    names = ("time", "q", "dq", "ddq", "measured", "moving")
    return replace(samples, **{name: getattr(samples, name)[rows] for name in names})


def _longest_run(same: NDArray[np.bool_]) -> tuple[int, int]:
    """Start and length of the longest run of true values."""
    edges = np.flatnonzero(np.diff(np.concatenate([[False], same, [False]]).astype(np.int8)))
    if not len(edges):
        return 0, 0
    starts, stops = edges[::2], edges[1::2]
    longest = int(np.argmax(stops - starts))
    return int(starts[longest]), int(stops[longest] - starts[longest])


def _nearest_lag(position: Array, lag: int, around: int) -> tuple[float, float]:
    """The lag in samples, a fraction included, near a given one at which the positions differ least, and by how much.

    Followed down to where they differ less than at the lags on either side. The difference (root mean square of the
    worst joint) is that at the vertex of the parabola through the minimum.
    """
    known: dict[int, float] = {}

    def difference(samples: int) -> float:
        if samples not in known:
            known[samples] = float(np.mean((position[samples:] - position[:-samples]) ** 2, axis=0).max())
        return known[samples]

    longest = len(position) - 2
    best = min(max(lag, 3), longest - 1)
    for _ in range(MOST_STEPS):
        near = range(max(2, best - around - 1), min(best + around + 2, longest) + 1)
        least = min(near, key=difference)
        if least == best:
            break
        best = least
    best = int(np.clip(best, 3, longest - 1))
    left, middle, right = difference(best - 1), difference(best), difference(best + 1)
    curvature = left - 2 * middle + right
    shift = float(np.clip(0.5 * (left - right) / curvature, -0.5, 0.5)) if curvature > 0 else 0.0
    vertex = middle - 0.25 * (left - right) * shift
    return best + shift, float(np.sqrt(max(vertex, 0.0)))


def _speeds_differ(velocity: Array, period: float) -> float:
    """Root mean square of the change of velocity (the worst joint's) from one period, in samples, to the next."""
    whole = int(period)
    part = period - whole
    later = (1 - part) * velocity[whole:-1] + part * velocity[whole + 1 :]
    return float(np.sqrt(np.mean((later - velocity[: len(later)]) ** 2, axis=0).max()))


def phase_scatter(samples: Samples, period: float) -> tuple[Array, NDArray[np.int64]]:
    """Squared differences of the `measured` between periods at the same phase, in its unit squared, and degrees of freedom
    behind them, by stretch of the phase (STRETCHES, columns); the columns are those of the joints, once or several times.

    The samples lie at other phases in each period; a cubic spline reads them at the same ones. The period is
    refined to where the positions scatter least. Phases at which a joint is about to turn round in any period are left
    out: there dry friction jumps within a sample, and a fraction of a sample is not noise.
    """
    from scipy.interpolate import CubicSpline
    from scipy.optimize import minimize_scalar

    step = median(np.diff(samples.time))
    clock = samples.time - samples.time[0]
    position = CubicSpline(clock, samples.q / np.maximum(np.ptp(samples.q, axis=0), 1e-12))

    def scatter_of_position(candidate: float) -> float:
        squares, freedom = _scatter(position, clock[-1], candidate, step)
        return float((squares.sum(0) / np.maximum(freedom.sum(0), 1)).sum())

    bounds = (period - step, period + step)
    # SciPy's stubs know the result only as a dictionary
    best = minimize_scalar(scatter_of_position, bounds=bounds, method="bounded", options={"xatol": 1e-6})
    period = float(best["x"])  # type: ignore[index]
    steady = _steady(samples)

    def is_steady(times: Array) -> NDArray[np.bool_]:
        rows = steady[np.clip(np.round(times / step).astype(int), 0, len(steady) - 1)]
        return np.tile(rows, samples.measured.shape[1] // rows.shape[1])

    return _scatter(CubicSpline(clock, samples.measured), clock[-1], period, step, is_steady)


def _steady(samples: Samples) -> NDArray[np.bool_]:
    """(N, joints): whether a joint moves on in its direction, a few samples before and after included."""
    from scipy.ndimage import minimum_filter1d

    direction = np.sign(samples.dq)
    wide = 2 * TURNING + 1
    goes_on = np.ones(samples.moving.shape, bool)
    goes_on[1:] = direction[1:] == direction[:-1]
    whole = (samples.moving & goes_on).astype(np.uint8)
    return np.asarray(minimum_filter1d(whole, wide, axis=0), bool)


def _scatter(
    course: Callable[[Array], Array],
    duration: float,
    period: float,
    step: float,
    counted: Callable[[Array], NDArray[np.bool_]] | None = None,
) -> tuple[Array, NDArray[np.int64]]:
    """Squared differences between periods at the same phase of a (samples, joints) course, and degrees of freedom, by
    stretch of the phase (STRETCHES, joints).

    counted : whether a joint's value at a time counts; a phase does where it counts in every period
    """
    phases = np.arange(0.0, period - 0.5 * step, step)
    joints = course(phases[:1]).shape[1]
    squares = np.zeros((STRETCHES, joints))
    freedom = np.zeros((STRETCHES, joints), np.int64)
    stretch = np.arange(len(phases)) * STRETCHES // max(1, len(phases))
    whole = int(duration / period)
    rest = phases[phases + whole * period <= duration]
    for covered, repeats in ((slice(0, len(rest)), whole + 1), (slice(len(rest), None), whole)):
        part = phases[covered]
        if repeats >= FEWEST_REPEATS and len(part):
            times = [part + index * period for index in range(repeats)]
            stack = np.array([course(each) for each in times])
            valid = np.ones(stack.shape[1:], bool)
            if counted is not None:
                valid = np.logical_and.reduce([counted(each) for each in times])
            np.add.at(squares, stretch[covered], np.sum((stack - stack.mean(0)) ** 2 * valid, axis=0))
            np.add.at(freedom, stretch[covered], (repeats - 1) * valid)
    return squares, freedom
