"""95 % intervals built on `std_robust` cover the truth when residuals are coloured; classical ones do not."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.signal import lfilter
from scipy.stats import t as student_distribution

from identify.estimation.least_squares import least_squares
from identify.estimation.observation import Observation, TimeBlock
from identify.estimation.statistics import (
    classical_deviation,
    deviation_from_blocks,
    effective_blocks,
    joined,
    leave_out,
    long_run_deviation,
    robust_deviation,
    student,
)
from identify.estimation.triangular_factor import TriangularFactor
from tests.identify.estimation.synthetic_observation import single

RATE = 40.0  # Hz, of the decimated samples
BLOCKS = 40  # for each session, as `observe` makes them


def slow_motion(duration, random):
    """Columns of eq. (8) for one joint on a sum of slow sinusoids, 0.1 to 0.7 Hz."""
    time = np.arange(round(duration * RATE)) / RATE
    frequency = 2 * np.pi * np.array([0.1, 0.2, 0.33, 0.5, 0.71])
    amplitude = random.uniform(0.2, 1.0, 5) / np.arange(1, 6)
    phase = frequency * time[:, None] + random.uniform(0, 2 * np.pi, 5)
    q, dq = np.sin(phase) @ amplitude, np.cos(phase) @ (amplitude * frequency)
    ddq = -np.sin(phase) @ (amplitude * frequency**2)
    ones = np.ones_like(time)
    return np.column_stack([ddq, 9.81 * np.cos(q), 9.81 * np.sin(q), np.sign(dq), dq, ones])


def coloured_noise(time_constant, count, draws, random):
    """(count, draws) AR(1) noise of unit deviation; white for a time constant of zero."""
    white = random.standard_normal((count, draws))
    if time_constant == 0:
        return white
    pole = np.exp(-1 / (time_constant * RATE))
    white[1:] *= np.sqrt(1 - pole**2)
    return lfilter([1.0], [1.0, -pole], white, axis=0)


class Draws:
    """Observations of one motion with ever new noise; only the part of the factors that Y makes is new."""

    def __init__(self, sessions):
        self.parts = [part for W in sessions for part in np.array_split(W, BLOCKS)]
        self.split = [np.linalg.qr(part) for part in self.parts]
        self.cuts = np.cumsum([len(part) for part in self.parts])[:-1]
        self.width = sessions[0].shape[1]
        self.blocks = [
            TimeBlock(session, float(block), float(block + 1))
            for session in range(len(sessions))
            for block in range(BLOCKS)
        ]

    def observation(self, Y):
        factors = []
        for part, (q, r), y in zip(self.parts, self.split, np.split(Y, self.cuts), strict=True):
            along = q.T @ y
            rest = np.sqrt(max(y @ y - along @ along, 0.0))
            rows = np.zeros((len(r) + 1, self.width + 2))
            rows[:-1, : self.width] = r
            rows[:-1, self.width :] = along[:, None]
            rows[-1, self.width :] = rest
            factors.append([TriangularFactor(rows, len(part))])
        columns = [np.arange(self.width)]
        entries = [None] * (self.blocks[-1].session + 1)
        return Observation(entries, self.width, [], [], columns, self.blocks, factors)


def coverage(durations, time_constant, draws, seed):
    """Part of the draws whose interval holds the truth, (2, parameters): classical and robust."""
    random = np.random.default_rng(seed)
    sessions = [slow_motion(duration, random) for duration in durations]
    drawing = Draws(sessions)
    W = np.vstack(sessions)
    truth = random.standard_normal(W.shape[1])
    noise = np.vstack([coloured_noise(time_constant, len(part), draws, random) for part in sessions])
    held = np.zeros((2, W.shape[1]))
    for draw in range(draws):
        observation = drawing.observation(W @ truth + noise[:, draw])
        fit = least_squares(observation)
        deviations = classical_deviation(fit), robust_deviation(observation, fit)
        held += [np.abs(fit.chi - truth) <= 1.96 * deviation for deviation in deviations]
    return held / draws


SHORT, LONG = (20.0,), (60.0, 60.0, 60.0)


@pytest.mark.parametrize("durations", [SHORT, LONG], ids=["20 s", "3 x 60 s"])
@pytest.mark.parametrize("time_constant", [0.1, 0.25])
def test_robust_intervals_cover_coloured_noise_where_classical_ones_do_not(durations, time_constant):
    classical, robust = coverage(durations, time_constant, draws=500, seed=1)
    assert np.all(classical < 0.75)
    assert 0.94 <= robust.mean() <= 0.97
    # a coverage of 95 % counted on 500 draws has a deviation of 1 %
    assert np.all((robust >= 0.92) & (robust <= 0.98))


@pytest.mark.parametrize("durations", [SHORT, LONG], ids=["20 s", "3 x 60 s"])
def test_robust_intervals_hold_for_white_noise_as_the_classical_ones_do(durations):
    classical, robust = coverage(durations, 0.0, draws=500, seed=2)
    assert np.all((classical >= 0.92) & (classical <= 0.98))
    assert np.all((robust >= 0.92) & (robust <= 0.99))


def test_the_quantile_of_students_distribution_is_that_of_scipy():
    freedom = np.array([3.0, 5.0, 12.0, 40.0, 1000.0])
    np.testing.assert_allclose(student(freedom), student_distribution.ppf(0.975, freedom), rtol=0.011)


def test_too_few_blocks_give_no_robust_deviation():
    random = np.random.default_rng(3)
    W = slow_motion(20.0, random)
    drawing = Draws([W])
    observation = drawing.observation(W @ np.ones(6) + random.standard_normal(len(W)))
    few = Observation(
        [None], 6, [], [], observation.joint_columns, observation.blocks[:4], observation.factors[:4]
    )
    assert np.isnan(robust_deviation(few, least_squares(few))).all()


def bartlett(influence, sessions, bandwidth):
    """Sum of the products of all pairs of blocks of one session, each with Bartlett's weight, written out."""
    total = 0.0
    for i, one in enumerate(influence):
        for j, other in enumerate(influence):
            if sessions[i] == sessions[j]:
                total += max(0.0, 1 - abs(i - j) / bandwidth) * one * other
    return total


@pytest.mark.parametrize("pole", [0.0, 0.3, 0.8, 0.999])
def test_the_long_run_deviation_is_andrews_s_and_kiefer_and_vogelsangs(pole):
    """Bandwidth 1.1447 (α n)^⅓ with α = 4 ρ² / ((1 − ρ)² (1 + ρ)²), at most half of the record; the quantile of b."""
    random = np.random.default_rng(8)
    count = 24
    sessions = np.repeat([0, 1], [14, 10])
    influence = lfilter([1.0], [1.0, -pole], random.standard_normal(count)) + 3.0 * (pole > 0.9)
    same = sessions[1:] == sessions[:-1]
    rho = np.clip(np.sum((influence[1:] * influence[:-1])[same]) / np.sum(influence**2), 0.0, 0.97)
    alpha = 4 * rho**2 / ((1 - rho) ** 2 * (1 + rho) ** 2)
    bandwidth = min(1 + 1.1447 * (alpha * count) ** (1 / 3), 12.0)
    assert bool(bandwidth == 12.0) is (pole > 0.7)
    b = bandwidth / count
    quantile = 1.96 + 2.9694 * b + 0.4160 * b**2 - 0.5324 * b**3
    variance = bartlett(influence, sessions, bandwidth) * (count - 1) / count
    found = long_run_deviation(influence[:, None], sessions)
    np.testing.assert_allclose(found, [np.sqrt(variance) * quantile / 1.96], rtol=1e-10)
    # parameters stand beside each other, each with a bandwidth of its own; one that nothing moves has none
    both = long_run_deviation(
        np.column_stack([influence, np.zeros(count), influence[::-1]]), np.zeros(count, int)
    )
    assert both[1] == 0.0
    assert both[0] == pytest.approx(both[2])


def test_blocks_that_alone_carry_a_parameter_are_few_and_widen_its_deviation():
    """Shares h of information: (Σh)²/Σh² is 1 for one block, n for n alike, 9/5 for shares 2 and 1."""
    slopes = np.zeros((6, 3, 3))
    slopes[2, 0, 0] = 5.0
    slopes[:, 1, 1] = 2.0
    slopes[0, 2, 2], slopes[1, 2, 2] = 4.0, 2.0
    np.testing.assert_allclose(effective_blocks(slopes, slopes), [1.0, 6.0, 9 / 5])


def test_a_deviation_is_the_long_run_one_widened_by_student_s_quantile_of_the_effective_blocks():
    random = np.random.default_rng(9)
    slopes = np.abs(random.standard_normal((8, 1, 1))) + 1.0
    scores = random.standard_normal((8, 1))
    scores -= scores.mean(0)
    sessions = np.zeros(8, int)
    effective = effective_blocks(slopes, slopes)
    expected = long_run_deviation(leave_out(slopes, scores), sessions) * student(effective - 1) / 1.96
    np.testing.assert_allclose(deviation_from_blocks(slopes, scores, slopes, sessions), expected)
    assert np.isnan(deviation_from_blocks(slopes[:5], scores[:5], slopes[:5], sessions[:5])).all()
    assert np.isfinite(deviation_from_blocks(slopes[:6], scores[:6], slopes[:6], sessions[:6])).all()
    assert np.isnan(deviation_from_blocks(slopes, 0 * scores, slopes, sessions)).all()


def test_leaving_a_block_out_is_fitting_again_without_it():
    random = np.random.default_rng(10)
    W, Y = random.standard_normal((60, 2)), random.standard_normal(60)
    chi = np.linalg.lstsq(W, Y, rcond=None)[0]
    parts = [slice(6 * k, 6 * k + 6) for k in range(10)]
    again = np.array(
        [
            np.linalg.lstsq(np.delete(W, np.r_[part], axis=0), np.delete(Y, np.r_[part]), rcond=None)[0] - chi
            for part in parts
        ]
    )
    slopes = np.array([W[part].T @ W[part] for part in parts])
    scores = np.array([W[part].T @ (Y[part] - W[part] @ chi) for part in parts])
    np.testing.assert_allclose(leave_out(slopes, scores), again - again.mean(0), rtol=1e-9, atol=1e-12)
    # a parameter that one block alone carries goes to zero without it
    slopes[:, 1, :] = slopes[:, :, 1] = 0.0
    slopes[3, 1, 1] = 2.0
    scores[:, 1] = 0.0
    assert leave_out(slopes, scores)[3, 1] == pytest.approx(0.0)


def test_the_classical_deviation_is_the_textbook_s():
    random = np.random.default_rng(11)
    W = random.standard_normal((30, 3))
    Y = W @ np.ones(3) + random.standard_normal(30)
    fit = least_squares(single(W, Y, 5))
    left = Y - W @ fit.chi
    variance = left @ left / (30 - 3)
    expected = np.sqrt(variance * np.diag(np.linalg.inv(W.T @ W)))
    np.testing.assert_allclose(classical_deviation(fit), expected, rtol=1e-9)
    exact = least_squares(single(W[:3], Y[:3], 1))
    assert np.isnan(classical_deviation(exact)).all()
    one_over = least_squares(single(W[:4], Y[:4], 1))
    assert np.isfinite(classical_deviation(one_over)).all()


def test_neighbours_of_one_session_are_joined_and_what_is_over_goes_to_the_last():
    assert joined(np.array([0, 0, 0, 0, 0, 1, 1, 1]), 2).tolist() == [0, 0, 1, 1, 1, 2, 2, 2]
    assert joined(np.array([0, 0, 1]), 4).tolist() == [0, 0, 1]
    assert joined(np.array([0, 0, 0]), 1).tolist() == [0, 1, 2]
