"""The parallel filter of section IV.B: Y and every column of W through one zero-phase low-pass, then
decimation.

Both sides of Y = W chi + rho pass the same linear operator, so the parameters stay what they are; ripple
and noise above the motion's bandwidth are gone, and what is left is sampled as rarely as it deserves.

Only the decimated samples are ever computed. The filter's impulse response (`zero_phase`: that of the
Butterworth filter run forward and backward, cut where it is below 1e-10) is laid out as a banded matrix
that turns a stretch of rows into a few decimated ones, so that filtering is a product of matrices: about 5
ns of CPU for a row of a column, where running the recursive filter to and fro over every sample takes 15
to 40 ns.
"""

from __future__ import annotations

import math
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from identify.signals import zero_phase

Array = NDArray[np.float64]

DECIMATION_OF_NYQUIST = 0.8
"""The cut-off lies at this part of the decimated Nyquist frequency: D = 0.8 (f_s / 2) / f_c."""
STRETCH = 96
"""Rows multiplied at a time, about: long enough for the matrix product to be quick, short enough to waste
little."""
LARGEST_PRODUCT = 1 << 17
"""Numbers held at a time between product and sum: 1 MB, which stays in the processor's cache."""
LARGEST_MULTIPLICATION = 1 << 18
"""Multiplications of one matrix product. OpenBLAS shares larger ones among threads, which for products this
small costs more CPU than it saves, and ten times as much on a machine that is busy."""


def decimation_factor(cutoff: float, sampling_period: float) -> int:
    """Samples for one decimated sample (at least 1)."""
    return max(1, int(DECIMATION_OF_NYQUIST * 0.5 / (cutoff * sampling_period) + 1e-9))


def decimate(
    columns: Array, first: int, count: int, factor: int, cutoff: float, sampling_period: float
) -> Array:
    """Low-pass columns and take every `factor`-th row.

    columns : (N, k); the rows picked are first, first + factor, ... (count of them); returns (count, k)
    Beyond its ends a column is continued oddly, as filtfilt does.
    """
    band, stretch, group = _band(cutoff, sampling_period, factor)
    stretches = band.shape[0] // group  # that one group of decimated rows reaches over
    half = zero_phase.memory(cutoff, sampling_period)
    groups = math.ceil(count / group)
    needed = (groups + stretches - 1) * stretch
    k = columns.shape[1]
    rows = _rows(columns, first - half, needed).reshape(-1, stretch, k)
    result = np.zeros((groups, group, k))
    width = max(1, min(k, LARGEST_MULTIPLICATION // band.size))
    for left in range(0, k, width):
        chunk = slice(left, min(left + width, k))
        _add_products(result[:, :, chunk], band, rows[:, :, chunk])
    return result.reshape(groups * group, k)[:count]


def _add_products(result: Array, band: Array, rows: Array) -> None:
    """Add what every stretch of rows, (stretches of the session, rows of a stretch, k), gives to every
    group."""
    groups, group, k = result.shape
    stretches = band.shape[0] // group
    at_once = max(1, LARGEST_PRODUCT // (band.shape[0] * k))
    for begin in range(0, len(rows), at_once):
        product = np.matmul(band, rows[begin : begin + at_once]).reshape(-1, stretches, group, k)
        for late in range(stretches):
            # Stretch number s adds its part `late` to the group that began `late` stretches before it.
            low, high = max(begin - late, 0), min(begin + len(product) - late, groups)
            if low < high:
                result[low:high] += product[low + late - begin : high + late - begin, late]


@lru_cache(maxsize=16)
def _band(cutoff: float, sampling_period: float, factor: int) -> tuple[Array, int, int]:
    """The banded matrix, (stretches x group, rows of a stretch); the rows of a stretch; decimated rows of a
    group."""
    kernel = zero_phase.impulse_response(cutoff, sampling_period)
    group = max(1, round(STRETCH / factor))
    stretch = group * factor
    stretches = math.ceil((len(kernel) + (group - 1) * factor) / stretch)
    band = np.zeros((group, stretches * stretch))
    for row in range(group):
        band[row, row * factor : row * factor + len(kernel)] = kernel
    return band.reshape(group, stretches, stretch).swapaxes(0, 1).reshape(-1, stretch).copy(), stretch, group


def _rows(columns: Array, start: int, needed: int) -> Array:
    """Rows start ... start + needed of the columns, continued oddly beyond their ends; C-contiguous."""
    before, after = max(-start, 0), max(start + needed - len(columns), 0)
    inner = columns[max(start, 0) : start + needed]
    if not before and not after:
        return np.ascontiguousarray(inner)
    rows = np.empty((needed, columns.shape[1]))
    rows[before : needed - after] = inner
    last = len(columns) - 1
    if before:
        rows[:before] = 2 * columns[0] - columns[np.minimum(np.arange(before, 0, -1), last)]
    if after:
        rows[needed - after :] = 2 * columns[last] - columns[np.maximum(last - 1 - np.arange(after), 0)]
    return rows
