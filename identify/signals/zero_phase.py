"""The zero-phase low-pass: a Butterworth filter run forward and backward, as a closed form.

Running a filter H forward and backward ("filtfilt") has the real frequency response |H|². For a Butterworth
filter of order N made by the bilinear transform it is

    G(w) = 1 / (1 + (tan(w T / 2) / tan(w_c T / 2))^(2 N))

exactly zero-phase, one half at the cut-off. Its impulse response decays exponentially, so it has, to any
wanted precision, a finite memory; that is what lets a session be filtered block by block with the same
result as in one piece.
"""

from __future__ import annotations

import math
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]

ORDER = 4
"""Of the Butterworth filter, each way: the paper's choice and that of the published EMPS identification."""
TAIL = 1e-10
"""Part of the impulse response that the memory leaves out."""
HIGHEST_CUTOFF = 0.4
"""Of the sampling frequency: above it the filter would pass everything up to Nyquist."""


def response(cutoff: float, sampling_period: float, frequency: Array, order: int = ORDER) -> Array:
    """G(w) above, at frequencies in Hz from 0 to Nyquist."""
    with np.errstate(over="ignore"):
        ratio = np.tan(np.minimum(np.pi * frequency * sampling_period, np.pi / 2 - 1e-12))
        return 1.0 / (1.0 + (ratio / math.tan(math.pi * cutoff * sampling_period)) ** (2 * order))


def frequencies(length: int, sampling_period: float) -> Array:
    """(length // 2 + 1,) Hz: where the Fourier transform of a real signal of that length is known."""
    return np.asarray(np.fft.rfftfreq(length, sampling_period), dtype=np.float64)


def decay_rate(cutoff: float, sampling_period: float, order: int = ORDER) -> float:
    """Decay of the impulse response, nepers per sample: that of the filter's slowest pole.

    The poles of the analogue prototype lie at w_c exp(j (pi/2 + pi (2k+1)/(2N))); the bilinear transform
    takes s to z = (1 + s T/2) / (1 - s T/2), with w_c prewarped.
    """
    warped = math.tan(math.pi * cutoff * sampling_period)
    angle = math.pi / 2 + math.pi / (2 * order)
    pole = warped * complex(math.cos(angle), math.sin(angle))
    return -math.log(abs((1 + pole) / (1 - pole)))


def memory(cutoff: float, sampling_period: float, tail: float = TAIL, order: int = ORDER) -> int:
    """Samples on each side after which the impulse response has decayed to `tail` of its start."""
    return math.ceil(-math.log(tail) / decay_rate(cutoff, sampling_period, order)) + 1


@lru_cache(maxsize=64)
def impulse_response(cutoff: float, sampling_period: float, order: int = ORDER) -> Array:
    """(2 m + 1,) the symmetric impulse response, m = `memory`; its sum is 1."""
    half = memory(cutoff, sampling_period, order=order)
    length = 1 << (4 * half).bit_length()
    frequency = frequencies(length, sampling_period)
    kernel = np.fft.irfft(response(cutoff, sampling_period, frequency, order), length)
    kernel = np.concatenate([kernel[-half:], kernel[: half + 1]])
    kernel /= kernel.sum()
    kernel.flags.writeable = False
    return kernel


@lru_cache(maxsize=64)
def fast_length(least: int) -> int:
    """The smallest length 2^a 3^b 5^c of at least `least` samples, quick for the Fourier transform."""
    best = 1 << max(least - 1, 1).bit_length()
    five = 1
    while five < best:
        three = five
        while three < best:
            length = three << max(-(-least // three) - 1, 0).bit_length()
            best = min(best, length)
            three *= 3
        five *= 5
    return best


def extended(values: Array, before: int, after: int) -> Array:
    """Rows reflected oddly about the first and the last one (as filtfilt does): value and slope go on
    without a step.

    values : (N, k); a reflection longer than the session goes on with the last reflected row.
    """
    rows = len(values)
    left = values[np.minimum(np.arange(before, 0, -1), rows - 1)]
    right = values[np.maximum(rows - 2 - np.arange(after), 0)]
    return np.concatenate([2 * values[:1] - left, values, 2 * values[-1:] - right])
