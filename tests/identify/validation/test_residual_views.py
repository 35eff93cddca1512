"""What pictures of a residual are drawn from, against signals of which it is known."""

import numpy as np
import pytest

from identify.validation.residual_views import (
    around_reversals,
    autocorrelation,
    distribution,
    position_spectrum,
    worst_stretch,
)


def test_the_worst_stretch_lies_in_one_session_and_holds_the_largest_error():
    time = np.tile(np.arange(0.0, 10.0, 0.1), 2)
    session = np.repeat([0, 1], 100)
    error = np.full(200, 0.1)
    error[130:140] = 3.0
    # large on both sides of the border between sessions, where no stretch may lie
    error[96:104] = 2.0
    rows = worst_stretch(session, time, error, 1.0)
    assert set(session[rows]) == {1}
    assert rows.start <= 130
    assert rows.stop >= 140
    assert time[rows][-1] - time[rows][0] <= 1.0 + 1e-9


def test_no_samples_have_no_worst_stretch():
    nothing = np.zeros(0)
    assert worst_stretch(nothing.astype(int), nothing, nothing, 1.0) == slice(0, 0)


def test_a_wave_over_position_has_its_amplitude_at_its_own_number_however_long_the_joint_stood_anywhere():
    rng = np.random.default_rng(1)
    # a joint that is ten times as often in one half of its range
    position = np.concatenate([rng.uniform(0, 2 * np.pi, 4000), rng.uniform(0, np.pi, 40_000)])
    error = 0.7 * np.cos(19 * position + 0.4) + 0.1 * rng.normal(size=len(position))
    numbers = np.arange(2.0, 40.0)
    amplitude = position_spectrum(position, error, numbers)
    assert numbers[np.argmax(amplitude)] == 19
    assert amplitude.max() == pytest.approx(0.7, rel=0.08)
    assert np.sort(amplitude)[-2] < 0.05


def test_the_correlation_of_an_autoregressive_error_falls_as_its_pole_and_white_noise_stays_within_bounds():
    rng = np.random.default_rng(2)
    white = rng.normal(size=20_000)
    coloured = np.zeros(20_000)
    for row in range(1, 20_000):
        coloured[row] = 0.8 * coloured[row - 1] + white[row]
    session, time = np.repeat([0, 1], 10_000), np.tile(0.01 * np.arange(10_000), 2)
    found = autocorrelation(session, time, coloured, 0.1)
    assert found.lag == pytest.approx(0.01 * np.arange(11))
    assert found.value == pytest.approx(0.8 ** np.arange(11), abs=0.05)
    noise = autocorrelation(session, time, white, 1.0)
    assert np.mean(np.abs(noise.value[1:]) < noise.bound) > 0.88


def test_the_correlation_of_chosen_samples_is_that_of_the_pairs_that_are_both_chosen():
    rng = np.random.default_rng(5)
    error = np.convolve(rng.normal(size=3000), np.ones(5) / 5, "same")
    session, time = np.repeat([0, 1], 1500), np.tile(0.01 * np.arange(1500), 2)
    chosen = (rng.random(3000) < 0.5) & (session == 1)
    found = autocorrelation(session, time, error, 0.3, chosen)
    rest = error - error.mean()
    pairs = [np.flatnonzero(chosen[: 3000 - lag] & chosen[lag:]) for lag in range(31)]
    direct = [np.mean(rest[rows] * rest[rows + lag]) for lag, rows in enumerate(pairs)]
    assert found.value == pytest.approx(np.array(direct) / direct[0])
    assert found.bound == pytest.approx(1.96 / np.sqrt(chosen.sum()))
    # samples of one moment only have no pairs far apart, and none chosen have no correlation
    short = autocorrelation(session, time, error, 0.5, (time < 0.2) & (session == 0))
    assert np.isnan(short.value[25:]).all()
    assert np.isfinite(short.value[0])
    assert np.isnan(autocorrelation(session, time, error, 0.3, np.zeros(3000, bool)).value).all()


def test_a_normal_error_lies_on_the_normal_distribution_and_its_bounds_hold_95_percent():
    error = np.random.default_rng(3).normal(2.0, 0.5, 200_000)
    found = distribution(error)
    assert found.share.sum() == pytest.approx(1.0, abs=1e-3)
    assert found.share == pytest.approx(found.normal, abs=2e-3)
    assert found.bounds == pytest.approx((2.0 - 1.96 * 0.5, 2.0 + 1.96 * 0.5), abs=0.02)


def test_a_torque_that_lags_behind_shows_its_lag_after_the_reversal():
    """A joint that swings; friction changes its sign 20 ms late."""
    time = np.arange(0.0, 40.0, 0.005)
    velocity = np.cos(2 * np.pi * time / 4.0 + 0.3)
    late = np.sign(np.cos(2 * np.pi * (time - 0.02) / 4.0 + 0.3))
    session = np.zeros(len(time), int)
    at, means, _ = around_reversals(session, time, velocity, np.stack([np.sign(velocity), late]), 0.2, 80)
    crossing = [at[np.flatnonzero(np.diff(np.sign(mean)) != 0)[0]] for mean in means]
    assert crossing[1] - crossing[0] == pytest.approx(0.02, abs=0.006)
    assert means[0][0] == pytest.approx(-1.0)
    assert means[0][-1] == pytest.approx(1.0)


@pytest.mark.parametrize("turns", [0, 1])
def test_a_joint_that_hardly_turns_has_an_empty_picture_not_an_error(turns):
    time = np.arange(0.0, 1.0, 0.01)
    velocity = np.where(time < 0.5, 1.0, -1.0 if turns else 1.0)
    at, means, _ = around_reversals(np.zeros(100, int), time, velocity, velocity[None], 0.1)
    assert at.shape == (48,)
    assert np.isfinite(means).any() == bool(turns)


def test_a_joint_that_rests_between_two_directions_turns_in_the_middle_of_its_rest():
    """It drives 1 s forwards, rests 0.1 s with noise of the encoder, and drives back; once it stops for a second."""
    time = np.arange(0.0, 12.0, 0.005)
    phase = (time % 2.2) / 1.1
    resting = (phase % 1.0) > 1.0 / 1.1
    velocity = np.where(phase < 1.0, 1.0, -1.0)
    velocity[resting] = 1e-6 * np.random.default_rng(2).normal(size=int(resting.sum()))
    stop = np.zeros(200)
    time, velocity = (
        np.arange(len(time) + 200) * 0.005,
        np.concatenate([velocity[:1095], stop, velocity[1095:]]),
    )
    moving = np.abs(velocity) > 0.5
    at, (direction,), share = around_reversals(
        np.zeros(len(time), int), time, velocity, np.sign(velocity)[None] * moving, 0.2, 40, moving
    )
    assert np.isfinite(direction).all()
    assert direction[at < -0.06] == pytest.approx(-1.0)
    assert direction[at > 0.06] == pytest.approx(1.0)
    assert share[np.abs(at) < 0.04] == pytest.approx(0.0)
    assert share[np.abs(at) > 0.06] == pytest.approx(1.0)
