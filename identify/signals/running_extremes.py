"""Largest and smallest value around every sample, in time that does not grow with the width of the window."""

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]


def running_maximum(values: Array, width: int) -> Array:
    """(N, ...) maximum over `width` (odd) samples around each; beyond the ends the first and last value go on.

    Each column is cut into pieces of `width`; a window covers the end of one piece and the beginning of the next,
    so it is the larger of two accumulated maxima (van Herk 1992; Gil, Werman 1993).
    """
    if width % 2 == 0:
        raise ValueError(f"width {width}: an odd number is needed")
    half, count = width // 2, len(values)
    after = half + (-(count + 2 * half)) % width
    around = ((half, after),) + ((0, 0),) * (values.ndim - 1)
    pieces = np.pad(values, around, mode="edge").reshape(-1, width, *values.shape[1:])
    forwards = np.maximum.accumulate(pieces, axis=1).reshape(-1, *values.shape[1:])
    backwards = np.maximum.accumulate(pieces[:, ::-1], axis=1)[:, ::-1].reshape(-1, *values.shape[1:])
    return np.maximum(backwards[:count], forwards[width - 1 : width - 1 + count])


def running_minimum(values: Array, width: int) -> Array:
    """(N, ...) minimum over `width` (odd) samples around each; see `running_maximum`."""
    return -running_maximum(-values, width)
