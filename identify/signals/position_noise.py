"""How finely the positions were recorded, read off the positions themselves."""

from collections.abc import Iterator

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]

SAMPLES = 50_000
"""Positions looked at; an encoder's step shows within the first moves."""


def position_step(position: Array) -> Array:
    """(n,) smallest step other than rounding, infinite where there is none."""
    smallest = np.full(position.shape[1], np.inf)
    for joint, course in enumerate(_courses(position)):
        steps = np.diff(course)
        np.abs(steps, out=steps)
        rounding = 1e-12 * max(1.0, course.max(), -course.min())
        smallest[joint] = steps[steps > rounding].min(initial=np.inf)
    return smallest


def position_rounding(position: Array) -> Array:
    """(n,) step of a rounding that would give these positions the scatter of their third differences.

    Third differences leave of the motion itself its jerk times the period cubed: next to nothing. A record whose
    digits are rounded more coarsely in places than in others has the scatter of both.
    """
    if len(position) < 8:
        return np.full(position.shape[1], np.inf)
    scatter = [np.std(np.diff(course, 3)) for course in _courses(position)]
    return np.sqrt(12.0 / 20.0) * np.array(scatter)


def _courses(position: Array) -> Iterator[Array]:
    """(N,) positions of one joint after the other, contiguous: the differences of one stay in the processor's cache, those of
    all joints side by side take four times as long."""
    for course in position.T:
        yield np.ascontiguousarray(course)
