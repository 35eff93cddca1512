"""The parallel filter of section IV.B: Y and every column of W through one zero-phase low-pass, then
decimation.

Both sides of Y = W chi + rho pass the same linear operator, so the parameters stay what they are; ripple
and noise above the motion's bandwidth are gone, and what is left is sampled as rarely as it deserves.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from identify.signals import zero_phase

Array = NDArray[np.float64]

DECIMATION_OF_NYQUIST = 0.8
"""The cut-off lies at this part of the decimated Nyquist frequency: decimate by D = 0.8 (f_s / 2) / f_c."""


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
    half = zero_phase.memory(cutoff, sampling_period)
    length = zero_phase.fast_length(len(columns) + 2 * half)
    frequency = np.fft.rfftfreq(length, sampling_period)
    gain = zero_phase.response(cutoff, sampling_period, frequency)
    padded = zero_phase.extended(columns, half, half)
    spectrum = np.fft.rfft(padded, length, axis=0)
    spectrum *= gain[:, None]
    filtered = np.fft.irfft(spectrum, length, axis=0)
    return filtered[half + first + factor * np.arange(count)]
