"""Up to which frequency a joint's inertia hears the motion, and from where on the encoder's noise.

Noise of the positions, white or rounding, grows with the fourth power of the frequency in the acceleration. The inertia
makes a torque of it that nobody measured. Least squares then finds the inertia too small (errors in variables), and what
is left over looks like every effect that smooths the acceleration: elasticity, backlash. Both count only where this
torque stands out of the noise that the measured torque has of its own.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from identify.recording import Session
from identify.recording.samples import release
from identify.signals.motion_spectrum import MotionSpectrum, pieces_of
from identify.signals.zero_phase import HIGHEST_CUTOFF, fast_length, frequencies

Array = NDArray[np.float64]

SHARE = 0.05
"""Of the power of the torque's own noise below the cut-off: so much may the encoder's noise add."""
NEGLIGIBLE = 5e-4
"""Of the torque's root mean square: so much may it add in any case."""
CENTRES = 32
"""Frequencies at which the averaged power is looked at."""
BAND_FROM = 0.5
"""Of the acceleration's bandwidth: from there on the inertia is looked for."""


@dataclass(frozen=True)
class EncoderNoise:
    """What one joint's encoder adds to the torque of its inertia.

    density       : (N m)² s⁴ / Hz, of the inertia times the position's noise; times (2 pi f)⁴ that of its torque
    torque_density: (N m)² / Hz, of the measured torque's own noise
    torque_power  : (N m)², mean square of the measured torque
    """

    density: float
    torque_density: float
    torque_power: float

    def highest_cutoff(self) -> float:
        """Hz: below it the encoder's noise stays within `SHARE` of the torque's own, or is `NEGLIGIBLE`.

        Its power up to f is density (2 pi)⁴ f⁵ / 5, that of the torque's own noise torque_density f.
        """
        if self.density <= 0:
            return np.inf
        scale = self.density * (2 * np.pi) ** 4 / 5
        beside_noise = (SHARE * self.torque_density / scale) ** (1 / 4)
        negligible = (NEGLIGIBLE**2 * self.torque_power / scale) ** (1 / 5)
        return float(max(beside_noise, negligible))


def encoder_noise(
    sessions: Sequence[Session], spectra: Sequence[MotionSpectrum | None], drive_gain: Array, joint: int
) -> EncoderNoise | None:
    """The noise of one joint over all sessions; None if it does not move."""
    products, cross = np.zeros((3, 3)), np.zeros(3)
    position_density, torque_density, torque_power = [], [], []
    for session, spectrum in zip(sessions, spectra, strict=True):
        if spectrum is None:
            continue
        power = _SessionPower(session, drive_gain, joint)
        power.add_inertia(spectrum, products, cross)
        lowest = min(spectrum.noise_from, 0.5 * HIGHEST_CUTOFF / session.sampling_period)
        position_density.append(power.floor(power.position_density, lowest))
        torque_density.append(power.floor(power.torque_density, lowest))
        torque_power.append(power.torque_power)
    if not position_density:
        return None
    scale = np.sqrt(np.maximum(np.diag(products), 1e-300))
    inertia = np.linalg.lstsq(products / np.outer(scale, scale), cross / scale, rcond=1e-9)[0][0] / scale[0]
    density = float(inertia**2 * np.mean(position_density))
    return EncoderNoise(density, float(np.mean(torque_density)), float(np.mean(torque_power)))


@lru_cache(maxsize=4)
def _unit_window(length: int) -> Array:
    """(length,) a Hann window of norm 1, the same for every joint of a session."""
    window = np.hanning(length)
    window /= np.linalg.norm(window)
    window.flags.writeable = False
    return window


class _SessionPower:
    """Spectra of the position and of the joint's torque in one session.

    frequency        : (F,) Hz
    position_density : (F,) rad²/Hz; torque_density : (F,) (N m)²/Hz, one-sided
    """

    def __init__(self, session: Session, drive_gain: Array, joint: int) -> None:
        period = session.sampling_period
        gains = np.flatnonzero(drive_gain[joint])
        self._acceleration, self._torque = [], []
        self.torque_power = 0.0
        pieces = pieces_of(session)
        for rows in pieces:
            position = np.array(session.position[rows, joint], dtype=float)
            torque = np.asarray(session.command[rows][:, gains]) @ drive_gain[joint, gains]
            self.torque_power += float(np.mean(torque**2)) / len(pieces)
            self._acceleration.append(self._spectrum(np.diff(position, 2) / period**2))
            self._torque.append(self._spectrum(torque[1:-1]))
        release(session.position)
        release(session.command)
        length = fast_length(pieces[0].stop - pieces[0].start - 2)
        self.frequency = frequencies(length, period)[1:]
        self._highest = HIGHEST_CUTOFF / period
        second_difference = (2 * np.sin(np.pi * self.frequency * period) / period) ** 4
        acceleration = np.mean([np.abs(spectrum) ** 2 for spectrum in self._acceleration], axis=0)
        self.position_density = 2 * period * acceleration / second_difference
        self.torque_density = (
            2 * period * np.mean([np.abs(spectrum) ** 2 for spectrum in self._torque], axis=0)
        )

    def _spectrum(self, values: Array) -> NDArray[np.complex128]:
        return np.fft.rfft(_unit_window(len(values)) * (values - values.mean()), fast_length(len(values)))[1:]

    def add_inertia(self, spectrum: MotionSpectrum, products: Array, cross: Array) -> None:
        """Add what the band of the acceleration says of torque = inertia ddq + viscous dq + stiffness q."""
        rate = 2j * np.pi * self.frequency
        upper = max(spectrum.noise_from, spectrum.acceleration_bandwidth)
        band = (self.frequency >= BAND_FROM * spectrum.acceleration_bandwidth) & (self.frequency <= upper)
        for acceleration, torque in zip(self._acceleration, self._torque, strict=True):
            columns = np.stack([acceleration, acceleration / rate, acceleration / rate**2])[:, band]
            products += np.real(columns.conj() @ columns.T)
            cross += np.real(columns.conj() @ torque[band])

    def floor(self, density: Array, lowest: float) -> float:
        """Least density, averaged over an octave, from a frequency up to the highest cut-off."""
        centres = np.geomspace(lowest, self._highest, CENTRES)
        first, last = np.searchsorted(self.frequency, np.outer([1 / np.sqrt(2), np.sqrt(2)], centres))
        first = np.minimum(first, len(density) - 1)
        last = np.maximum(np.minimum(last, len(density)), first + 1)
        held = np.concatenate([[0.0], np.cumsum(density)])
        return float(np.min((held[last] - held[first]) / (last - first)))
