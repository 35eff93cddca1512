"""Joint velocities and accelerations from recorded positions (paper, section IV.B).

A zero-phase Butterworth low-pass, then central differences. Both are linear and time-invariant, so they are
one product in the frequency domain: G(w) of `zero_phase`, times the response of the central difference for
each derivative.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from identify.signals import zero_phase

Array = NDArray[np.float64]


def central_difference(frequency: Array, sampling_period: float) -> Array:
    """Response of the central difference, divided by the imaginary unit, rad/s.

    The five-point formula (x[-2] - 8 x[-1] + 8 x[1] - x[2]) / (12 T); its amplitude is (w T)^4 / 30 short
    of w, 5e-7 at a hundredth of the sampling frequency, where the three-point formula has 7e-4.
    """
    angle = 2 * np.pi * frequency * sampling_period
    return (8 * np.sin(angle) - np.sin(2 * angle)) / (6 * sampling_period)


def differentiate(
    position: Array, sampling_period: float, cutoff: Sequence[float]
) -> tuple[Array, Array, Array]:
    """Filtered position, velocity and acceleration of a piece of uniform samples.

    position : (N, n); cutoff : Hz, one for each joint; returns three arrays (N, n).
    The rows within `memory` of an end that is not the record's own are wrong and are the caller's to drop.
    """
    rows, n = position.shape
    half = memory(sampling_period, cutoff)
    length = zero_phase.fast_length(rows + 2 * half)
    frequency = zero_phase.frequencies(length, sampling_period)
    derivative = central_difference(frequency, sampling_period)
    q, dq, ddq = np.empty((n, rows)), np.empty((n, rows)), np.empty((n, rows))
    kept = slice(half, half + rows)
    padded = zero_phase.extended(position, half, half)
    for joint in range(n):
        # The straight line through the ends carries the mean and the slope exactly; what is left starts and
        # ends at zero, so the periodic Fourier transform sees no step.
        line = np.linspace(padded[0, joint], padded[-1, joint], len(padded))
        slope = (padded[-1, joint] - padded[0, joint]) / ((len(padded) - 1) * sampling_period)
        spectrum = np.fft.rfft(padded[:, joint] - line, length)
        spectrum *= zero_phase.response(cutoff[joint], sampling_period, frequency)
        q[joint] = np.fft.irfft(spectrum, length)[kept] + line[kept]
        spectrum *= 1j * derivative
        dq[joint] = np.fft.irfft(spectrum, length)[kept] + slope
        spectrum *= 1j * derivative
        ddq[joint] = np.fft.irfft(spectrum, length)[kept]
    return q.T, dq.T, ddq.T


def memory(sampling_period: float, cutoff: Sequence[float]) -> int:
    """Samples on each side that a filtered sample depends on, differences included."""
    return max(zero_phase.memory(value, sampling_period) for value in cutoff) + 4
