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
from collections.abc import Sequence
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
NUMBERS_AT_ONCE = 1 << 17
"""Rows times columns laid out and multiplied at a time: 1 MB, which stays in the processor's cache."""
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
    return decimate_tables([columns], first, count, factor, cutoff, sampling_period)


def decimate_tables(
    tables: Sequence[Array], first: int, count: int, factor: int, cutoff: float, sampling_period: float
) -> Array:
    """`decimate` for the columns of several tables side by side, which are never copied into one.

    tables : at least one, of (N, k_i); returns (count, sum of k_i)
    """
    band, stretch, group = _band(cutoff, sampling_period, factor)
    reached = len(band) // group  # stretches that one group of decimated rows reaches over
    start = first - zero_phase.memory(cutoff, sampling_period)
    groups = math.ceil(count / group)
    stretches = groups + reached - 1
    result = np.empty((groups, group, sum(table.shape[1] for table in tables)))
    width = max(1, NUMBERS_AT_ONCE // (stretches * stretch))
    at_once = max(1, LARGEST_MULTIPLICATION // band.size)
    laid_out = np.empty((width, stretches * stretch))
    product = np.empty(len(band) * width * stretches)
    done = waiting = 0

    def filter_waiting() -> None:
        """The columns laid out, as one matrix of stretches: few wide products instead of one for each narrow table."""
        products = product[: len(band) * waiting * stretches].reshape(len(band), -1)
        rows = laid_out[:waiting].reshape(waiting * stretches, stretch).T
        for begin in range(0, waiting * stretches, at_once):
            some = slice(begin, begin + at_once)
            np.matmul(band, rows[:, some], out=products[:, some])
        parts = products.reshape(reached, group, waiting, stretches)
        # Stretch number s adds its part `late` to the group that began `late` stretches before it.
        summed = parts[0, :, :, :groups]
        for late in range(1, reached):
            summed += parts[late, :, :, late : late + groups]
        result[:, :, done - waiting : done] = summed.transpose(2, 0, 1)

    for table in tables:
        left = 0
        while left < table.shape[1]:
            columns = table[:, left : left + width - waiting].T
            _lay_out(columns, start, laid_out[waiting : waiting + len(columns)])
            left, done, waiting = left + len(columns), done + len(columns), waiting + len(columns)
            if waiting == width:
                filter_waiting()
                waiting = 0
    if waiting:
        filter_waiting()
    return result.reshape(groups * group, -1)[:count]


def _lay_out(columns: Array, start: int, rows: Array) -> None:
    """Samples start ... of columns (k, N), continued oddly beyond their ends, into rows (k, needed)."""
    samples, needed = columns.shape[1], rows.shape[1]
    before, after = max(-start, 0), max(start + needed - samples, 0)
    rows[:, before : needed - after] = columns[:, max(start, 0) : start + needed]
    last = samples - 1
    if before:
        rows[:, :before] = 2 * columns[:, :1] - columns[:, np.minimum(np.arange(before, 0, -1), last)]
    if after:
        rows[:, needed - after :] = (
            2 * columns[:, -1:] - columns[:, np.maximum(last - 1 - np.arange(after), 0)]
        )


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
