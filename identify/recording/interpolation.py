"""Local interpolation between recorded samples."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]


def interpolate(old: Array, values: Array, new: Array, cubic: bool) -> Array:
    """Interpolate columns at new instants from the nearest samples: four (Lagrange's cubic), or two
    (straight line).

    old : (N,) increasing; values : (N, k); new : (M,); an instant outside old's range takes the nearest
    end's polynomial Returns (M, k); at an old instant its own value, exactly.
    """
    points = min(4 if cubic else 2, len(old))
    right = np.searchsorted(old, new, side="right")
    first = np.clip(right - points // 2, 0, len(old) - points)
    result = np.zeros((len(new), values.shape[1]))
    nodes = [old[first + point] for point in range(points)]
    for point, node in enumerate(nodes):
        weight = np.ones(len(new))
        for other, beside in enumerate(nodes):
            if other != point:
                weight *= (new - beside) / (node - beside)
        result += weight[:, None] * values[first + point]
    return result


def previous(old: Array, values: NDArray[Any], new: Array) -> NDArray[Any]:
    """The value last recorded at or before each new instant."""
    return values[np.clip(np.searchsorted(old, new, side="right") - 1, 0, len(old) - 1)]
