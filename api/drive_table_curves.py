"""What a model gives along the record over one variable, in intervals: the curve that a table is to hold, and its spread."""

import numpy as np
from numpy.typing import NDArray

from identify.export.support_points import SLOWEST

Array = NDArray[np.float64]
Curve = tuple[tuple[float, float, float, float], ...]

SLOW_INTERVALS, FAST_INTERVALS, TURN_INTERVALS = 8, 25, 64
SLOW = 0.05
"""of the top speed; below, where friction changes most, intervals grow by equal parts, above they are of equal width"""
SPREAD = (10.0, 90.0)
"""percentiles beside the median: friction over speed alone is a band where it depends on load, position or temperature too"""


def curve_over_speed(speed: Array, current: Array) -> Curve:
    """Mean speed, median and both percentiles of the current, A, in intervals of either direction; (N,) rad/s of the motor, A.

    Samples slower than any support point are left out, and intervals without samples.
    """
    top = float(np.abs(speed).max(initial=0.0))
    if not top > 0.0:
        return ()
    slow = np.geomspace(SLOWEST * top, SLOW * top, SLOW_INTERVALS + 1)
    edges = np.concatenate([slow, np.linspace(SLOW * top, top, FAST_INTERVALS + 1)[1:]])
    back = _curve(-speed, current, edges)
    turned = tuple((-at, middle, low, high) for at, middle, low, high in reversed(back))
    return (*turned, *_curve(speed, current, edges))


def curve_over_turn(angle: Array, current: Array) -> Curve:
    """The same over the turn of the motor, 0 to 1; (N,) rad, A."""
    return _curve(np.mod(angle / (2.0 * np.pi), 1.0), current, np.linspace(0.0, 1.0, TURN_INTERVALS + 1))


def _curve(x: Array, value: Array, edges: Array) -> Curve:
    place = np.digitize(x, edges) - 1
    place[x == edges[-1]] = len(edges) - 2
    rows: list[tuple[float, float, float, float]] = []
    for each in range(len(edges) - 1):
        within = place == each
        if within.any():
            low, high = np.percentile(value[within], SPREAD)
            rows.append((float(x[within].mean()), float(np.median(value[within])), float(low), float(high)))
    return tuple(rows)
