"""The rule that chooses cut-offs from the data (section IV.B: look at the spectrum, five times the motion's
bandwidth).

1. The motion's bandwidth f_m holds 98 % of the power of the acceleration, and 95 % of that of the
velocity's sign, of
   every joint in every identification session. Noise is told from motion by the valley between them in the
   acceleration's spectrum (`motion_spectrum`).
2. The positions are low-passed at 5 f_m; lower where, for a coarse or noisy encoder, noise would make up a
third of the
   acceleration; never above 0.4 of the sampling frequency.
3. Y and W are low-passed at 2 f_m, and decimated so that this is 0.8 of the new Nyquist frequency; higher
if fewer than
   100 decimated samples were left; lower, down to f_m / 2, where the torque that the inertia makes of the encoder's
   noise would stand out of the measured torque's own noise (`encoder_noise`). The positions are then low-passed at
   2.5 times this cut-off.

What the user sets in the experiment stays. Every number is reported with its reason.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from identify.recording import Experiment, InputError, Session
from identify.signals import parallel_filter
from identify.signals.encoder_noise import encoder_noise
from identify.signals.motion_spectrum import POWER_HELD, MotionSpectrum, motion_spectrum
from identify.signals.settings import Choice, SignalSettings
from identify.signals.zero_phase import HIGHEST_CUTOFF

POSITION_TIMES_MOTION = 5.0
DECIMATION_TIMES_MOTION = 2.0
LEAST_TIMES_MOTION = 0.5
"""Of the motion's bandwidth: no noise lowers the parallel filter further. Where reversals set the bandwidth, the
positions are then still low-passed at six times the fundamental of the motion."""
HIGHEST_REASON = f"{HIGHEST_CUTOFF:g} of the sampling frequency, the highest possible"
LARGEST_NOISE_SHARE = 0.5
"""Noise in the acceleration, in parts of the motion's power."""
FEWEST_DECIMATED = 100
"""Decimated samples of all identification sessions together, for each joint."""


def choose_signal_settings(experiment: Experiment) -> SignalSettings:
    """Choose the cut-offs of an experiment from its identification sessions; what the user has set stays.

    Raises InputError: a session's file is wrong, no joint moves, or a cut-off that the user set is above
    Nyquist.
    """
    entries = [entry for entry in experiment.sessions if entry.role == "identification"]
    if not entries:
        raise InputError(f"{experiment.path}: sessions: none has the role identification; nothing to fit")
    return choose_from_sessions(experiment, [experiment.read(entry) for entry in entries])


def choose_from_sessions(experiment: Experiment, sessions: Sequence[Session]) -> SignalSettings:
    """The rule on sessions that are read already (see `choose_signal_settings`)."""
    names = [joint.name for joint in experiment.robot.joints]
    set_by_user = experiment.signals
    slowest = max(session.sampling_period for session in sessions)
    highest = HIGHEST_CUTOFF / slowest
    _check_user(experiment, 0.5 / slowest)
    spectra = [[motion_spectrum(session, joint) for session in sessions] for joint in range(len(names))]
    moving = [(name, each) for name, each in zip(names, spectra, strict=True) if any(each)]
    if not moving:
        raise InputError(
            f"{sessions[0].entry.path}: no joint moves, so there is nothing to identify; record a motion"
        )
    widest, spectrum = max(
        ((name, one) for name, each in moving for one in each if one), key=lambda pair: pair[1].bandwidth
    )
    motion = spectrum.bandwidth
    what = (
        "acceleration"
        if spectrum.acceleration_bandwidth >= spectrum.reversal_bandwidth
        else "reversals of speed"
    )
    choices = [
        Choice(
            "motion_bandwidth",
            motion,
            "Hz",
            f"holds {POWER_HELD:.0%} of the power of the {what} of {widest}, the joint that reaches highest",
        )
    ]
    noisiest = _noisiest(experiment, sessions, spectra) if set_by_user.decimation_cutoff is None else None
    decimation = _decimation(set_by_user.decimation_cutoff, motion, noisiest, sessions, highest, choices)
    reach = decimation / DECIMATION_TIMES_MOTION
    if set_by_user.decimation_cutoff is not None:
        reach = max(reach, motion)
    wanted = POSITION_TIMES_MOTION * reach
    position = []
    for joint, name in enumerate(names):
        value = _set_for(set_by_user.position_cutoff, joint)
        reason = "set in the experiment"
        if value is None:
            value, reason = _position(wanted, decimation, motion, spectra[joint], highest)
        choices.append(Choice(f"position_cutoff of {name}", value, "Hz", reason))
        position.append(value)
    return SignalSettings(tuple(position), decimation, tuple(choices))


def _decimation(
    given: float | None,
    motion: float,
    noisiest: tuple[float, str] | None,
    sessions: Sequence[Session],
    highest: float,
    choices: list[Choice],
) -> float:
    duration = sum(
        (piece.stop - piece.start) * session.sampling_period
        for session in sessions
        for piece in session.segments
    )
    value = DECIMATION_TIMES_MOTION * motion
    fewest = FEWEST_DECIMATED * parallel_filter.DECIMATION_OF_NYQUIST / (2 * duration)
    reason = f"{DECIMATION_TIMES_MOTION:g} times the motion's bandwidth"
    if noisiest is not None and noisiest[0] < value:
        cutoff, joint = noisiest
        value = max(cutoff, LEAST_TIMES_MOTION * motion)
        reason = (
            f"less than {DECIMATION_TIMES_MOTION:g} times the motion's bandwidth, because from {cutoff:.3g} Hz the"
            f" noise of the encoder of {joint} adds to the torque of its inertia"
        )
    if value < fewest:
        value, reason = fewest, f"leaves {FEWEST_DECIMATED} decimated samples of {duration:.3g} s of motion"
    if value > highest:
        value, reason = highest, HIGHEST_REASON
    value = _three_digits(value)
    if given is not None:
        value, reason = given, "set in the experiment"
    choices.append(Choice("decimation_cutoff", value, "Hz", reason))
    return value


def _noisiest(
    experiment: Experiment, sessions: Sequence[Session], spectra: Sequence[Sequence[MotionSpectrum | None]]
) -> tuple[float, str]:
    """The lowest cut-off that the encoders' noise asks for, and the joint that does."""
    cutoffs = []
    for joint, description in enumerate(experiment.robot.joints):
        noise = encoder_noise(sessions, spectra[joint], experiment.drive_gain, joint)
        if noise is not None:
            cutoffs.append((noise.highest_cutoff(), description.name))
    return min(cutoffs)


def _position(
    wanted: float,
    decimation: float,
    motion: float,
    spectra: Sequence[MotionSpectrum | None],
    highest: float,
) -> tuple[float, str]:
    """The position cut-off of one joint and the reason."""
    value, reason = wanted, f"{POSITION_TIMES_MOTION:g} times the motion's bandwidth"
    if abs(wanted / (POSITION_TIMES_MOTION * motion) - 1) > 0.01:
        ratio = POSITION_TIMES_MOTION / DECIMATION_TIMES_MOTION
        reason = f"{ratio:g} times the cut-off of the parallel filter"
    for spectrum in spectra:
        if spectrum is None or spectrum.noise_share(value) <= LARGEST_NOISE_SHARE:
            continue
        steps = np.linspace(value, min(decimation, value), 32)
        value = next((x for x in steps if spectrum.noise_share(x) <= LARGEST_NOISE_SHARE), steps[-1])
        reason = (
            f"less than {wanted:.3g} Hz, because noise makes up most of the acceleration"
            f" from {spectrum.noise_from:.3g} Hz"
        )
    if value > highest:
        value, reason = highest, HIGHEST_REASON
    return _three_digits(value), reason


def _set_for(given: float | tuple[float, ...] | None, joint: int) -> float | None:
    return given[joint] if isinstance(given, tuple) else given


def _check_user(experiment: Experiment, nyquist: float) -> None:
    position = experiment.signals.position_cutoff
    given = {"decimation_cutoff": experiment.signals.decimation_cutoff}
    if isinstance(position, tuple):
        given |= {f"position_cutoff[{joint}]": value for joint, value in enumerate(position)}
    else:
        given["position_cutoff"] = position
    for name, value in given.items():
        if value is not None and value >= nyquist:
            raise InputError(
                f"{experiment.path}: signals.{name}: {value:g} Hz is not below the Nyquist frequency"
                f" of the record, {nyquist:g} Hz"
            )


def _three_digits(value: float) -> float:
    return float(f"{value:.3g}")
