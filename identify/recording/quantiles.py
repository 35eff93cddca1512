"""Quantiles of finite samples. Those of NumPy, like `np.unique` and `np.setdiff1d`, import all of `numpy.ma` to ask whether the
values are masked: a fiftieth of the processor time of `identify`."""

from collections.abc import Sequence

import numpy as np
from numpy.typing import ArrayLike, NDArray

Array = NDArray[np.float64]


def quantiles(values: ArrayLike, parts: Sequence[float] | Array) -> Array:
    """(m,) or (m, k): quantiles of values (N,), or of each column of (N, k), linear between two values.

    parts : (m,) from 0 to 1
    """
    samples = np.asarray(values, dtype=np.float64)
    place = np.asarray(parts, dtype=np.float64) * (len(samples) - 1)
    below = place.astype(np.intp)
    above = np.minimum(below + 1, len(samples) - 1)
    ordered = np.partition(samples, sorted({*below.tolist(), *above.tolist()}), axis=0)
    between = (place - below).reshape(-1, *(1,) * (samples.ndim - 1))
    return ordered[below] + between * (ordered[above] - ordered[below])


def quantile(values: ArrayLike, part: float) -> Array:
    """One of `quantiles`: () or (k,)."""
    return quantiles(values, [part])[0]


def median(values: ArrayLike) -> float:
    """The middle one of values (N,), or the mean of the two middle ones."""
    return float(quantile(values, 0.5))
