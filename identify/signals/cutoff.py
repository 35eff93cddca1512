"""The rule that chooses cut-offs from the data (section IV.B: "look at the spectrum")."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from identify.recording import Experiment, Session
from identify.signals.settings import Choice, SignalSettings
from identify.signals.zero_phase import HIGHEST_CUTOFF

Array = NDArray[np.float64]

MOTION_POWER = 0.99
"""The motion's bandwidth holds this part of the velocity's power."""
TIMES_MOTION = 5.0
"""The position cut-off is at least so many times the motion's bandwidth (section IV.B)."""


def choose_signal_settings(experiment: Experiment) -> SignalSettings:
    """Choose the cut-offs of an experiment from its identification sessions; what the user has set stays.

    :raises InputError: a session's file is wrong.
    """
    sessions = [experiment.read(entry) for entry in experiment.sessions if entry.role == "identification"]
    bandwidth = np.max([motion_bandwidth(session) for session in sessions], axis=0)
    highest = HIGHEST_CUTOFF / max(session.sampling_period for session in sessions)
    position = tuple(float(min(value * 4 * TIMES_MOTION, highest)) for value in bandwidth)
    decimation = float(min(bandwidth.max() * TIMES_MOTION, highest))
    return SignalSettings(position, decimation, (Choice("decimation_cutoff", decimation, "Hz", "motion"),))


def motion_bandwidth(session: Session) -> Array:
    """(n,) Hz: the frequency below which `MOTION_POWER` of each joint's velocity power lies."""
    period = session.sampling_period
    segment = max(session.segments, key=lambda piece: piece.stop - piece.start)
    velocity = np.diff(session.position[segment], axis=0) / period
    power = np.abs(np.fft.rfft(velocity * np.hanning(len(velocity))[:, None], axis=0)) ** 2
    frequency = np.fft.rfftfreq(len(velocity), period)
    part = np.cumsum(power, axis=0) / np.maximum(power.sum(axis=0), 1e-300)
    return frequency[np.argmax(part >= MOTION_POWER, axis=0)]
