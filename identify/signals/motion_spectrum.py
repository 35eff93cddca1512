"""How far the motion reaches in frequency, and where noise takes over, read off the recorded positions."""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from identify.recording import Session
from identify.recording.quantiles import median, quantile
from identify.recording.samples import release
from identify.signals import differentiation
from identify.signals.zero_phase import HIGHEST_CUTOFF, fast_length, frequencies

Array = NDArray[np.float64]

POWER_HELD = 0.98
"""The motion's bandwidth holds this part of the acceleration's power. With it, twice and five times the
bandwidth are the cut-offs that the literature of identification uses on machines whose bandwidth is
known."""
POSITION_HELD = 0.999
"""Noise is looked for above the frequency that holds this part of the position's power."""
VALLEY_WITHIN = 2.0
"""Times the least power between motion and the sampling frequency: that near counts as the valley."""
CENTRES = 64
"""Frequencies at which the averaged power is looked at."""
REVERSALS_HELD = 0.95
"""The same for the sign of the velocity, which falls off more slowly: up to about the seventh harmonic of a
sine."""
STICTION_PART = 0.02
"""Of the highest speed: within it, the sign of the velocity is taken to change gradually."""
AT_REST = 20.0
"""A joint whose range is less than so many times its sample-to-sample noise does not move."""
LONGEST_BLOCK = 1 << 17
"""Samples looked at in one piece."""
MOST_BLOCKS = 16
"""Pieces looked at in one session, evenly spread."""


@dataclass(frozen=True, eq=False)
class MotionSpectrum:
    """What the recorded positions of one joint in one session say about its motion."""

    acceleration_bandwidth: float
    """Hz; holds `POWER_HELD` of the acceleration's power above noise."""
    reversal_bandwidth: float
    """Hz; holds `REVERSALS_HELD` of the power of the velocity's sign, which dry friction follows."""
    noise_from: float
    """Hz; above it the second derivative of the position is noise and vibration, no longer motion."""
    frequency: Array
    """(F,) Hz"""
    acceleration_power: Array
    """(F,) of the second difference of the position, up to a constant factor."""

    @property
    def bandwidth(self) -> float:
        """Hz; of the motion, acceleration and reversals alike."""
        return max(self.acceleration_bandwidth, self.reversal_bandwidth)

    def noise_share(self, cutoff: float) -> float:
        """Power of the acceleration between `noise_from` and a cut-off, in parts of the power below."""
        below = self.frequency <= self.noise_from
        noise = (self.frequency <= cutoff) & ~below
        return float(self.acceleration_power[noise].sum() / self.acceleration_power[below].sum())


def motion_spectrum(session: Session, joint: int) -> MotionSpectrum | None:
    """Spectrum of one joint's motion; None if the joint does not move.

    The acceleration is the plain second difference: differencing first keeps the leakage of the large slow
    motion away from the small fast one.
    """
    period = session.sampling_period
    pieces = [np.array(session.position[rows, joint], dtype=float) for rows in pieces_of(session)]
    release(session.position)
    noise = median([np.std(np.diff(piece, 2)) for piece in pieces]) / np.sqrt(6.0)
    if np.ptp(np.concatenate([piece[:: max(1, len(piece) // 4096)] for piece in pieces])) <= AT_REST * noise:
        return None
    frequency, power = _mean_power([np.diff(piece, 2) for piece in pieces], period)
    lowest = _holding(*_mean_power([_levelled(piece) for piece in pieces], period), POSITION_HELD)
    valley, level = _valley(frequency, power, np.sqrt(2) * lowest, HIGHEST_CUTOFF / period)
    below = frequency <= valley
    above_noise = np.maximum(power[below] - level * (frequency[below] / valley) ** 4, 0.0)
    bandwidth = _holding(frequency[below], above_noise, POWER_HELD)
    return MotionSpectrum(bandwidth, _reversal_bandwidth(pieces, period, valley), valley, frequency, power)


def velocity_bandwidth(pieces: list[Array], period: float, part: float) -> float:
    """Hz; holds a part of the power of the velocity of positions recorded in pieces of equal length, (N,) each."""
    return _holding(*_mean_power([np.diff(piece) for piece in pieces], period), part)


def _levelled(values: Array) -> Array:
    """Values without the straight line through their ends."""
    return values - np.linspace(values[0], values[-1], len(values))


def pieces_of(session: Session) -> list[slice]:
    """Rows of the pieces to look at: equally long, evenly spread over the long segments of a session."""
    longest = max(piece.stop - piece.start for piece in session.segments)
    length = min(longest, LONGEST_BLOCK)
    starts = [
        start
        for segment in session.segments
        for start in range(segment.start, segment.stop - length + 1, max(length // 2, 1))
    ]
    chosen = np.linspace(0, len(starts) - 1, min(len(starts), MOST_BLOCKS)).round().astype(int)
    return [slice(starts[index], starts[index] + length) for index in chosen]


def _mean_power(pieces: list[Array], period: float) -> tuple[Array, Array]:
    """Frequencies above zero, Hz, and the mean power of the pieces under a Hann window (Welch)."""
    window = _hann(len(pieces[0]))
    length = fast_length(len(window))
    power = np.mean(
        [np.abs(np.fft.rfft(window * (piece - piece.mean()), length)) ** 2 for piece in pieces], axis=0
    )
    return frequencies(length, period)[1:], np.asarray(power)[1:]


@lru_cache(maxsize=4)
def _hann(length: int) -> Array:
    """The window, the same for every joint of a session; each is looked at three times."""
    window = np.hanning(length)
    window.flags.writeable = False
    return window


def _holding(frequency: Array, power: Array, part: float) -> float:
    """The frequency below which a part of the power lies."""
    held = np.cumsum(power)
    return float(frequency[np.searchsorted(held, part * held[-1])])


def _valley(frequency: Array, power: Array, lowest: float, highest: float) -> tuple[float, float]:
    """Where motion ends and noise begins: where the power, averaged over an octave, first comes down to its
    valley.

    A notch in the motion's own spectrum is no valley, since the power falls lower beyond it; nor does it
    matter that vibrations above make several valleys alike. Returns the frequency and the power there.
    """
    centres = np.geomspace(min(lowest, highest / 2), highest, CENTRES)
    first, last = np.searchsorted(frequency, np.outer([1 / np.sqrt(2), np.sqrt(2)], centres))
    first = np.minimum(first, len(power) - 1)
    last = np.maximum(np.minimum(last, len(power)), first + 1)
    held = np.concatenate([[0.0], np.cumsum(power)])
    mean = (held[last] - held[first]) / (last - first)
    valley = int(np.argmax(mean <= VALLEY_WITHIN * mean.min()))
    return float(centres[valley]), float(mean[valley])


def _reversal_bandwidth(pieces: list[Array], period: float, cutoff: float) -> float:
    signs = []
    for piece in pieces:
        velocity = differentiation.velocity(piece[:, None], period, (cutoff,))[:, 0]
        threshold = STICTION_PART * quantile(np.abs(velocity), 0.995)
        signs.append(np.clip(velocity / max(threshold, 1e-300), -1.0, 1.0))
    return _holding(*_mean_power(signs, period), REVERSALS_HELD)
