"""Probabilities of effects against closed forms: one fold has no bootstrap, a known memory a known number of samples."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.signal import lfilter

from identify.diagnosis.probability import (
    SURE,
    independent_samples,
    joint_probabilities,
    needed,
    probabilities,
)
from identify.diagnosis.structure import Structure
from identify.estimation.prediction import Prediction
from tests.identify.diagnosis.findings import finding, held_out, instruments


def prediction(residual: np.ndarray, moving: np.ndarray | None = None) -> Prediction:
    """A joint of which only the residual matters."""
    zero = np.zeros(len(residual))
    moves = np.ones(len(residual), bool) if moving is None else moving
    return Prediction("s.csv", "j1", zero, zero, zero, zero, zero, residual, zero, moves, None)


def test_exponential_noise_is_worth_the_closed_form_s_samples():
    """1 + 2 Σ aᵏ = (1 + a) / (1 − a) samples of noise with a memory a count as one."""
    a, count = 0.8, 200_000
    white = np.random.default_rng(5).standard_normal(count)
    left = np.asarray(lfilter([1.0], [1.0, -a], white))
    assert independent_samples([prediction(left)]) == pytest.approx(count * (1 - a) / (1 + a), rel=0.1)
    assert independent_samples([prediction(white)]) == pytest.approx(count, rel=0.05)
    two = independent_samples([prediction(left), prediction(white)])
    assert two == pytest.approx(
        independent_samples([prediction(left)]) + independent_samples([prediction(white)])
    )


def test_the_sum_over_the_memory_ends_where_the_autocorrelation_first_falls_below_zero():
    """By hand: 1 1 1 1 −1 −1 −1 −1 has ρ = 1, 5/8, … ; a quarter of 8 samples leaves only ρ₁."""
    left = np.array([1.0] * 4 + [-1.0] * 4)
    assert independent_samples([prediction(left)]) == pytest.approx(8 / (1 + 2 * 5 / 8))
    # ρ of 16: 13/16, 10/16, 7/16 within a quarter
    left = np.repeat([1.0, -1.0], 8)
    assert independent_samples([prediction(left)]) == pytest.approx(16 / (1 + 2 * (13 + 10 + 7) / 16))
    # alternating: ρ₁ < 0 ends the sum at once, and no sample counts for more than one
    assert independent_samples([prediction(np.tile([1.0, -1.0], 20))]) == 40.0


def test_short_stretches_and_silent_ones_count_as_they_are_and_rest_is_left_out():
    assert independent_samples([prediction(np.ones(7))]) == 7.0
    assert independent_samples([prediction(np.zeros(50))]) == 50.0
    assert independent_samples([prediction(np.zeros(0))]) == 1.0
    tail = np.concatenate([np.tile([1.0, -1.0], 20), np.full(30, 9.0)])
    assert independent_samples([prediction(tail, np.arange(70) < 40)]) == 40.0


def test_with_one_fold_the_probability_is_the_ratio_of_the_likelihoods():
    """The likelihood of n samples whose variance is v is v^(−n/2); the candidates share one half."""
    n, errors = 20.0, np.array([4.0, 3.0, 3.6])
    alone, others = probabilities(held_out(errors[0]), [held_out(e) for e in errors[1:]], n)
    likelihood = np.array([0.5, 0.25, 0.25]) * errors ** (-n / 2)
    np.testing.assert_allclose([alone, *others], likelihood / likelihood.sum(), rtol=1e-12)
    assert needed(held_out(4.0), held_out(3.0), n) == pytest.approx(1 / (1 + (3 / 4) ** (n / 2)))


def test_folds_count_by_their_share_and_scatter_takes_the_certainty_away():
    """The same total: alike in all folds it is sure, in one fold alone it is not."""
    before = held_out(*[1.0] * 8)
    steady = needed(before, held_out(*[0.6] * 8), 60.0)
    single = needed(before, held_out(*[1.0] * 7, 0.0001), 60.0)
    assert steady == pytest.approx(1 / (1 + 0.6**30), rel=1e-6)
    assert 0.2 < single < 0.9
    nothing, _ = probabilities(before, [], 60.0)
    assert nothing == 1.0


def test_folds_of_different_weight_are_drawn_from_the_first_model_s_shares():
    """By hand with the bootstrap written out: folds of 3 and 1 of the error, 16 samples."""
    before, after = held_out(3.0, 1.0), held_out(2.0, 1.5)
    weights = np.random.default_rng(0).dirichlet(np.ones(2), 400) * 2
    share = np.array([0.75, 0.25])
    logarithms = []
    for folds in (np.array([3.0, 1.0]), np.array([2.0, 1.5])):
        v = folds.sum() / 16
        logarithms.append(weights @ (-8 * share * np.log(v) - folds / (2 * v)))
    expected = np.mean(1 / (1 + np.exp(logarithms[0] - logarithms[1])))
    assert needed(before, after, 16.0) == pytest.approx(expected, rel=1e-10)


@pytest.mark.parametrize(
    ("share", "deviation", "unexplained"),
    [
        (0.0, 0.001, 0.05),
        (0.05, 0.01, 0.05),  # half of what is called structure and less: nothing
        (0.075, 0.01, 0.15),  # three quarters of it
        (0.1, 0.01, 0.25),
        (0.2, 0.01, 0.45),
        (0.2, 0.07, 0.05),  # not three standard errors
    ],
)
def test_what_comes_near_structure_is_a_little_unexplained(share, deviation, unexplained):
    left = [Structure(("q",), share, deviation, least=0.1), Structure(("dq",), 0.01, 0.001, least=0.1)]
    found = joint_probabilities([], 10.0, {}, {}, left, "adequate")
    assert found.unexplained == pytest.approx(unexplained)
    assert found.adequate == pytest.approx(1 - unexplained)
    assert joint_probabilities([], 10.0, {}, {}, left, "unexplained").unexplained == 0.9


def test_candidates_that_are_not_justified_leave_a_joint_adequate():
    """What is improbable to matter is not counted against the model."""
    n, before = 20.0, held_out(4.0)
    weak = finding(before, held_out(3.9), "weak", p_value=0.5)
    strong = finding(before, held_out(3.0), "strong")
    alone, (of_weak, of_strong) = probabilities(before, [weak.after, strong.after], n)
    assert not strong.justified  # acts in one fold only
    found = joint_probabilities([weak, strong], n, {}, {}, [], "adequate")
    assert found.effects == pytest.approx({"weak": SURE * of_weak, "strong": SURE * of_strong})
    assert found.adequate == pytest.approx((alone + of_weak + of_strong) * 0.95)
    folds = held_out(*[1.0] * 10)
    sure = finding(folds, held_out(*[0.5] * 10), "sure")
    assert sure.justified
    alone, (weight,) = probabilities(folds, [sure.after], n)
    found = joint_probabilities([sure], n, {}, {}, [], "adequate")
    assert found.adequate == pytest.approx(alone * 0.95)
    assert found.effects == pytest.approx({"sure": SURE * weight})


@pytest.mark.parametrize(
    ("figures", "counts"),
    [
        ({"loop": None}, False),  # instruments were not asked
        ({"loop": instruments(1e-4)}, True),
        ({"loop": instruments(0.5)}, False),  # they saw nothing
    ],
)
def test_an_effect_of_derivatives_counts_only_as_far_as_instruments_saw_it(figures, counts):
    before, after = held_out(*[1.0] * 10), held_out(*[0.5] * 10)
    found = joint_probabilities(
        [finding(before, after, "lag", from_derivatives=True, **figures)], 20.0, {}, {}, [], "adequate"
    )
    expected = needed(before, after if counts else before, 20.0)
    assert found.effects["lag"] == pytest.approx(SURE * expected)


def test_a_named_effect_shares_what_it_has_with_its_rivals():
    """1 for the effect that is named and one half for each rival that is not named itself."""
    before, after = held_out(*[1.0] * 10), held_out(*[0.5] * 10)
    need = SURE * needed(before, after, 20.0)
    named = {"friction": finding(before, after, "friction"), "spring": finding(before, after, "spring")}
    found = joint_probabilities([], 20.0, named, {"friction": ["drag", "spring", "ripple"]}, [], "missing")
    assert found.effects == pytest.approx(
        {"friction": need / 2, "drag": need / 4, "ripple": need / 4, "spring": need}
    )
    assert found.adequate == pytest.approx(0.95 * (1 - need) ** 2)
