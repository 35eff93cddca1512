"""The bandwidth of motion that was made of a few known frequencies, and where noise of a known kind takes over."""

import numpy as np
import pytest

from identify.signals import motion_spectrum as module
from identify.signals.motion_spectrum import _levelled, motion_spectrum, pieces_of, velocity_bandwidth

PERIOD, SAMPLES = 1e-3, 40_000
TIME = PERIOD * np.arange(SAMPLES)
NOISE = np.random.default_rng(5).normal(size=SAMPLES)


def swing(*frequencies, noise=1e-6):
    """Sinusoids whose accelerations are equally strong."""
    smooth = sum(np.sin(2 * np.pi * f * TIME + f) / f**2 for f in frequencies)
    return smooth + noise * NOISE


@pytest.mark.parametrize("highest", [2.0, 7.0, 15.0])
def test_the_bandwidth_is_the_highest_frequency_that_carries_acceleration(made_session, highest):
    spectrum = motion_spectrum(made_session(swing(*np.arange(0.5, highest + 0.5, 0.5)), PERIOD), 0)
    # the window spreads a line over a few bins of 1/40 Hz
    assert spectrum.acceleration_bandwidth == pytest.approx(highest, abs=0.2)
    assert spectrum.bandwidth == max(spectrum.acceleration_bandwidth, spectrum.reversal_bandwidth)
    assert spectrum.noise_from > highest


def test_a_line_with_less_than_its_share_of_the_power_does_not_count(made_session):
    weak = swing(2.0) + 0.05 * (swing(9.0) - 1e-6 * NOISE)
    assert motion_spectrum(made_session(weak, PERIOD), 0).acceleration_bandwidth == pytest.approx(
        2.0, abs=0.2
    )


def test_dry_friction_of_a_sine_reaches_to_about_its_seventh_harmonic(made_session):
    spectrum = motion_spectrum(made_session(swing(1.0), PERIOD), 0)
    assert 5.0 < spectrum.reversal_bandwidth < 9.5


@pytest.mark.parametrize(("noise", "expected"), [(1e-7, 60.0), (1e-5, 20.0)])
def test_more_noise_takes_over_earlier(made_session, noise, expected):
    spectrum = motion_spectrum(made_session(swing(0.5, 2.0, noise=noise), PERIOD), 0)
    assert 2.0 < spectrum.noise_from < expected


def test_the_share_of_noise_grows_with_the_cut_off_and_is_none_below_the_motion(made_session):
    spectrum = motion_spectrum(made_session(swing(0.5, 2.0), PERIOD), 0)
    assert spectrum.noise_share(spectrum.noise_from) == 0.0
    shares = [spectrum.noise_share(cutoff) for cutoff in (50.0, 100.0, 400.0)]
    assert shares == sorted(shares)
    assert shares[0] > 0
    power, frequency = spectrum.acceleration_power, spectrum.frequency
    below = frequency <= spectrum.noise_from
    assert spectrum.noise_share(1e9) == pytest.approx(power[~below].sum() / power[below].sum())


def test_a_joint_whose_range_is_that_of_its_noise_does_not_move(made_session):
    assert motion_spectrum(made_session(1e-6 * NOISE, PERIOD), 0) is None
    both = made_session(np.column_stack([1e-6 * NOISE, swing(1.0)]), PERIOD)
    assert motion_spectrum(both, 0) is None
    assert motion_spectrum(both, 1) is not None


def test_a_line_in_the_velocity_is_found_where_it_is():
    piece = np.sin(2 * np.pi * 3.0 * TIME)
    assert velocity_bandwidth([piece, piece], PERIOD, 0.9) == pytest.approx(3.0, abs=0.1)


def test_pieces_are_equally_long_evenly_spread_and_lie_inside_the_segments(made_session, monkeypatch):
    monkeypatch.setattr(module, "LONGEST_BLOCK", 1000)
    segments = (slice(100, 700), slice(2000, 9000), slice(9500, 9800))
    rows = pieces_of(made_session(np.zeros(10_000), PERIOD, segments=segments))
    assert {piece.stop - piece.start for piece in rows} == {1000}
    assert all(piece.start >= 2000 and piece.stop <= 9000 for piece in rows)
    assert (rows[0].start, rows[-1].stop) == (2000, 9000)
    # a long record is looked at in sixteen pieces, ends included
    many = pieces_of(made_session(np.zeros(40_000), PERIOD))
    assert len(many) == 16
    assert (many[0].start, many[-1].stop) == (0, 40_000)
    assert np.ptp(np.diff([piece.start for piece in many])) <= 500


def test_a_drift_from_end_to_end_is_no_motion_of_any_frequency():
    ramp = 3.0 + 0.25 * np.arange(50)
    np.testing.assert_allclose(_levelled(ramp), 0.0, atol=1e-12)
    bump = np.sin(np.linspace(0, np.pi, 50))
    np.testing.assert_allclose(_levelled(ramp + bump), bump, atol=1e-12)
