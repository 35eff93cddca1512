"""Two sessions over each other from the same beginning, on one axis of time."""

from collections.abc import Mapping

import numpy as np
from numpy.typing import NDArray

from api.service.envelope import visible_rows
from api.service.stored_samples import StoredSamples
from api.service.torque_outline import CURVES

Array = NDArray[np.float64]


def overlaid(
    first: StoredSamples,
    second: StoredSamples,
    start: float | None,
    stop: float | None,
    points: int,
    chosen: NDArray[np.bool_] | None = None,
) -> tuple[Array, dict[str, Array]]:
    """Time (points,) s as the first session counts it, and measured, predicted and error of both in that range; those of
    the second are named `measured overlay` and so on. `chosen` is 1 where samples of the first are, given by (samples,) of
    it, else NaN.

    Where samples are many, each piece of time gives its least and its greatest value; where they are few, each curve is
    read off at the instants of an even time. NaN where a session has no samples.
    """
    begin = float(first.time[0])
    later = begin - float(second.time[0])
    end = max(float(first.time[-1]), float(second.time[-1]) + later)
    low, high = (begin if start is None else start), (end if stop is None else stop)
    high = max(high, low + 1e-9)
    curves: dict[str, Array] = {}
    marks: Array | None = None
    step = min(_step(first), _step(second))
    many = (high - low) / step > points
    edges = np.linspace(low, high, points // 2 + 1) if many else np.arange(low, high + step / 2, step)
    for part, shift, ending in ((first, 0.0, ""), (second, later, " overlay")):
        rows = visible_rows(part.time, low - shift, high - shift)
        time = np.asarray(part.time[rows]) + shift
        signals = {"measured": np.asarray(part.measured[rows]), "predicted": np.asarray(part.predicted[rows])}
        signals["error"] = part.error(rows)
        if chosen is not None and part is first:
            signals["chosen"] = np.where(chosen[rows], 1.0, np.nan)
        drawn = _extremes(time, signals, edges) if many else _read_off(time, signals, edges, 2 * _step(part))
        curves |= {f"{name}{ending}": drawn[name] for name in CURVES}
        if "chosen" in drawn:
            marks = drawn["chosen"]
    if marks is not None:
        curves["chosen"] = marks
    if not many:
        return edges, curves
    middles = (edges[:-1] + edges[1:]) / 2
    return np.stack([edges[:-1], middles], axis=1).ravel(), curves


def _step(part: StoredSamples) -> float:
    """s between samples; of a session of a single one, all of it."""
    time = part.time
    return float(np.median(np.diff(time[:1000]))) if len(time) > 1 else 1.0


def _extremes(time: Array, signals: Mapping[str, Array], edges: Array) -> dict[str, Array]:
    """Least and greatest value between each two edges, as pairs; NaN where no sample is."""
    bounds = np.searchsorted(time, edges)
    filled = np.flatnonzero(bounds[1:] > bounds[:-1])
    extremes = {}
    for name, values in signals.items():
        pairs = np.full((len(edges) - 1, 2), np.nan)
        if len(filled):
            # The last piece ends with the range: what comes after it is not its own.
            inside = values[: bounds[-1]]
            pairs[filled, 0] = np.fmin.reduceat(inside, bounds[filled])
            pairs[filled, 1] = np.fmax.reduceat(inside, bounds[filled])
        extremes[name] = pairs.ravel()
    return extremes


def _read_off(time: Array, signals: Mapping[str, Array], at: Array, reach: float) -> dict[str, Array]:
    """Values at some instants, between samples on a straight line; NaN farther than `reach` s from any sample."""
    if not len(time):
        return {name: np.full(len(at), np.nan) for name in signals}
    after = np.clip(np.searchsorted(time, at), 0, len(time) - 1)
    nearest = np.minimum(np.abs(time[after] - at), np.abs(time[np.maximum(after - 1, 0)] - at))
    return {
        name: np.where(nearest <= reach, np.interp(at, time, values), np.nan)
        for name, values in signals.items()
    }
