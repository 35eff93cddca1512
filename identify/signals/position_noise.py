"""How finely the positions were recorded, read off the positions themselves."""

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]

SAMPLES = 50_000
"""Positions looked at; an encoder's step shows within the first moves."""


def position_step(position: Array) -> Array:
    """(n,) smallest step other than rounding, infinite where there is none."""
    steps = np.abs(np.diff(position, axis=0))
    rounding = 1e-12 * np.maximum(1.0, np.abs(position).max(axis=0))
    return np.where(steps > rounding, steps, np.inf).min(axis=0)


def position_rounding(position: Array) -> Array:
    """(n,) step of a rounding that would give these positions the scatter of their third differences.

    Third differences leave of the motion itself its jerk times the period cubed: next to nothing. A record whose
    digits are rounded more coarsely in places than in others has the scatter of both.
    """
    if len(position) < 8:
        return np.full(position.shape[1], np.inf)
    return np.sqrt(12.0 / 20.0) * np.std(np.diff(position, 3, axis=0), axis=0)
