"""Joint velocities and accelerations from recorded positions (paper, section IV.B).

A zero-phase Butterworth low-pass, then central differences. Both are linear and time-invariant, so they are
one product in the frequency domain: G(w) of `zero_phase`, times the response of the central difference for
each derivative.
"""

from __future__ import annotations

from collections.abc import Sequence
from functools import lru_cache

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
    The rows within `memory` of an end that is not the session's own are wrong and are the caller's to drop.
    """
    piece = _Filtered(position, sampling_period, cutoff)
    return piece.course(0) + piece.line, piece.course(1) + piece.slope, piece.course(2)


def velocity(position: Array, sampling_period: float, cutoff: Sequence[float]) -> Array:
    """The velocity of `differentiate` alone, (N, n)."""
    piece = _Filtered(position, sampling_period, cutoff)
    return piece.course(1) + piece.slope


class _Filtered:
    """The spectrum of filtered positions less the straight line through the ends of the piece.

    The line carries the mean and the slope exactly; what is left starts and ends at zero, so the periodic Fourier
    transform sees no step.

    line  : (N, n) of every joint, rad or m
    slope : (n,) rad/s or m/s
    """

    def __init__(self, position: Array, sampling_period: float, cutoff: Sequence[float]) -> None:
        rows = len(position)
        half = memory(sampling_period, cutoff)
        padded = zero_phase.extended(position, half, half)
        line = np.linspace(padded[0], padded[-1], len(padded))
        self._kept = slice(half, half + rows)
        self._length = zero_phase.fast_length(len(padded))
        frequency = zero_phase.frequencies(self._length, sampling_period)
        self._derivative = _response_of_derivative(self._length, sampling_period)
        gains = {value: zero_phase.response(value, sampling_period, frequency) for value in set(cutoff)}
        self._spectrum = np.fft.rfft((padded - line).T, self._length)
        for joint, value in enumerate(cutoff):
            self._spectrum[joint] *= gains[value]
        self.line = line[self._kept]
        self.slope = (padded[-1] - padded[0]) / ((len(padded) - 1) * sampling_period)

    def course(self, order: int) -> Array:
        """(N, n) derivative of an order, the line left out."""
        spectrum = self._spectrum * self._derivative**order if order else self._spectrum
        return np.fft.irfft(spectrum, self._length)[:, self._kept].T


@lru_cache(maxsize=4)
def _response_of_derivative(length: int, sampling_period: float) -> NDArray[np.complex128]:
    """(length // 2 + 1,) the same for every joint and block of that length."""
    difference = central_difference(zero_phase.frequencies(length, sampling_period), sampling_period)
    response = np.asarray(1j * difference, np.complex128)
    response.flags.writeable = False
    return response


def memory(sampling_period: float, cutoff: Sequence[float]) -> int:
    """Samples on each side that a filtered sample depends on, differences included."""
    return max(zero_phase.memory(value, sampling_period) for value in cutoff) + 4
