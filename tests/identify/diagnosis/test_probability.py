"""Probabilities of effects against closed forms: one fold has no bootstrap, a known memory a known number of samples."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.signal import lfilter

from identify.diagnosis.probability import (
    independent_samples,
    joint_probabilities,
    needed,
    probabilities,
    probability_left,
    shares,
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


def sure(candidates: int, questions: int) -> float:
    """Of a word of the catalogue at most: half of all priors are of nothing, candidates and questions have the other half
    alike, and a tenth of the causes of no catalogue is not found."""
    missed = 0.1 * 0.5 * questions / (candidates + questions)
    return 1 - missed / (missed + 0.5 + 0.5 * candidates / (candidates + questions))


@pytest.mark.parametrize(
    ("share", "deviation", "way"),
    [
        (0.0, 0.001, 0.0),
        (0.05, 0.01, 0.0),  # half of what is called structure and less: nothing
        (0.075, 0.01, 0.25),  # three quarters of it
        (0.1, 0.01, 0.5),
        (0.2, 0.01, 1.0),
        (0.2, 0.07, 0.0),  # not three standard errors
    ],
)
def test_what_comes_near_structure_is_a_little_unexplained(share, deviation, way):
    left = [Structure(("q",), share, deviation, least=0.1), Structure(("dq",), 0.01, 0.001, least=0.1)]
    found = joint_probabilities([], 10.0, {}, {}, left, "adequate")
    unexplained = (1 - way) * (1 - sure(0, 2)) + way * 0.5
    assert found.unexplained == pytest.approx(unexplained)
    assert found.adequate == pytest.approx(1 - unexplained)
    assert joint_probabilities([], 10.0, {}, {}, left, "unexplained").unexplained == 0.9


def test_what_is_too_small_to_be_missing_leaves_a_joint_adequate():
    """An effect is missing in those draws of the bootstrap in which it is worth a name; its other weight is the model's."""
    n, before = 4000.0, held_out(*[1.0] * 10)
    small = finding(before, held_out(*[0.98] * 10), "small")  # 1 % of the error, certainly
    large = finding(before, held_out(*[0.96] * 10), "large")  # 2 %
    assert small.least_gain == pytest.approx(10 * (1 - 0.985**2)) == large.least_gain
    assert needed(before, small.after, n) == pytest.approx(1.0)
    found = joint_probabilities([small], n, {}, {}, [], "adequate")
    assert found.effects == {"small": 0.0}
    assert found.adequate == pytest.approx(1.0)
    found = joint_probabilities([], n, {"large": large}, {}, [], "missing")
    assert found.effects["large"] == pytest.approx(likely(1e-4))
    assert found.adequate == pytest.approx(1 - likely(1e-4))
    # what is asked of whatever effect it is
    found = joint_probabilities([large], n, {}, {}, [], "adequate", least=0.5)
    assert found.effects["large"] == 0.0


def test_a_size_at_the_edge_counts_in_the_draws_that_reach_it():
    n, before = 4000.0, held_out(*[1.0] * 10)
    after = held_out(*[0.96, 0.98] * 5)  # 1.5 % of the error on the whole
    found = needed(before, after, n, 10 * (1 - 0.985**2))
    weights = np.random.default_rng(0).dirichlet(np.ones(10), 400) * 10
    assert found == pytest.approx(np.mean(10 - weights @ after.fold >= 10 * (1 - 0.985**2)), abs=1e-6)
    assert 0.3 < found < 0.7


def test_a_cause_of_no_catalogue_leaves_the_catalogue_the_rest():
    n, before = 400.0, held_out(*[1.0] * 10)
    imitates = finding(before, held_out(*[0.5] * 10), "spring")
    found = joint_probabilities([imitates], n, {}, {}, [], "unexplained")
    assert found.unexplained == 0.9
    assert found.effects["spring"] == pytest.approx(0.1 * 0.5)
    assert found.effects["spring"] + found.unexplained + found.adequate <= 1.0


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
        [finding(before, after, "lag", from_derivatives=True, **figures)], 20.0, {}, {}, [], "unexplained"
    )
    expected = min(0.5, needed(before, after if counts else before, 20.0, 0.1))
    assert found.effects["lag"] == pytest.approx(0.1 * expected)


def test_of_an_effect_of_derivatives_counts_what_instruments_account_for():
    before, after = held_out(*[1.0] * 10), held_out(*[0.7] * 10)
    lag = finding(before, after, "lag", from_derivatives=True, loop=instruments(1e-4, part=0.4))
    found = joint_probabilities([lag, finding(before, before, "idle")], 10.0, {}, {}, [], "unexplained")
    expected = probabilities(before, [held_out(*[0.88] * 10), before], 10.0)[1][0]
    assert 0.1 < expected < 0.5
    assert found.effects["lag"] == pytest.approx(0.1 * expected)


def likely(p_value: float) -> float:
    """Of an effect with this p-value at most: odds that −e p ln p gives (Sellke, Bayarri, Berger), even at 0.01."""
    against, even = (-np.e * p * np.log(p) for p in (p_value, 0.01))
    return float(even / (even + against))


@pytest.mark.parametrize(("p_value", "most"), [(1e-4, likely(1e-4)), (0.01, 0.5), (0.9, 0.125 / 1.125)])
def test_the_evidence_bounds_what_the_density_says(p_value, most):
    """From 1/e on a p-value says nothing, and what is left is what the least at 0.01 is of that."""
    before, after = held_out(*[1.0] * 10), held_out(*[0.5] * 10)
    found = joint_probabilities(
        [finding(before, after, "spring", p_value=p_value)], 400.0, {}, {}, [], "unexplained"
    )
    assert found.effects["spring"] == pytest.approx(0.1 * min(0.5, most), rel=2e-3)


def test_what_a_session_refutes_is_not_probable():
    before, after = held_out(*[1.0] * 10), held_out(*[0.5] * 10)
    disagrees = finding(before, after, "spring", sessions_agree=False)
    assert joint_probabilities([disagrees], 400.0, {}, {}, [], "adequate").adequate == pytest.approx(1.0)
    harms = finding(before, after, "spring")
    found = joint_probabilities([harms], 400.0, {}, {}, [], "adequate", harmful={"spring"})
    assert found.effects["spring"] == 0.0


@given(
    gains=st.lists(st.floats(-0.2, 0.9), max_size=6),
    p_values=st.lists(st.floats(0.0, 1.0), min_size=6, max_size=6),
    samples=st.floats(1.0, 1e4),
    share=st.floats(0.0, 1.0),
    named_p=st.floats(0.0, 0.0099),
    verdict=st.sampled_from(["adequate", "missing", "unexplained"]),
)
def test_what_is_said_is_at_least_as_probable_as_not_and_what_is_not_said_at_most(
    gains, p_values, samples, share, named_p, verdict
):
    before = held_out(*[1.0] * 10)
    last = [
        finding(before, held_out(*[1.0 - gain] * 10), f"effect {place}", p_value=p)
        for place, (gain, p) in enumerate(zip(gains, p_values, strict=False))
    ]
    named = {"named": finding(before, held_out(*[0.96] * 10), "named", p_value=named_p)}
    left = [Structure(("q",), share, 0.001)]
    told = joint_probabilities(
        last, samples, named if verdict == "missing" else {}, {"named": ["effect 0"]}, left, verdict
    )
    even = 0.5 * sure(len(last), 1)
    assert (told.unexplained > 0.5) == (verdict == "unexplained")
    if verdict == "missing":
        assert told.effects["named"] + told.effects.get("effect 0", 0.0) >= even - 1e-9
        assert told.adequate <= 1 - even
    else:
        assert max(told.effects.values(), default=0.0) <= 0.5
    if verdict == "adequate":
        assert told.adequate >= 0.5 - 1e-9
    assert sum(told.effects.values()) + told.unexplained + told.adequate <= 1 + 1e-9 or verdict == "missing"


def test_a_named_effect_shares_what_it_has_with_its_rivals_by_their_evidence():
    """One of them is right: each has its likelihood on unseen motion; what was not compared does as well as what is named."""
    n, before, after, worse = 20.0, held_out(*[1.0] * 10), held_out(*[0.5] * 10), held_out(*[0.6] * 10)
    need = min(needed(before, after, n), likely(1e-4))
    named = {"friction": finding(before, after, "friction"), "spring": finding(before, after, "spring")}
    contested = {"friction": [named["friction"], finding(before, worse, "drag")]}
    rivals = {"friction": ["drag", "spring", "ripple"]}
    found = joint_probabilities([], n, named, rivals, [], "missing", contested)
    likelihood = np.array([1.0, (5 / 6) ** (n / 2), 1.0])
    expected = need * likelihood / likelihood.sum()
    assert found.effects == pytest.approx(
        dict(zip(("friction", "drag", "ripple"), expected, strict=True)) | {"spring": need}
    )
    assert found.adequate == pytest.approx((1 - need) ** 2)
    np.testing.assert_allclose(shares([after, after], n), [0.5, 0.5])


def test_no_word_of_a_catalogue_is_surer_than_the_questions_to_what_is_left():
    """Eleven questions beside 25 candidates: 1.7 % is a cause that none of them found, and a named effect has the rest."""
    before = held_out(*[1.0] * 10)
    idle = [finding(before, before, f"effect {place}") for place in range(25)]
    certain = {"spring": finding(before, held_out(*[0.5] * 10), "spring", p_value=1e-300)}
    quiet = [Structure((f"view {place}",), 0.0, 0.01) for place in range(11)]
    found = joint_probabilities(idle, 4000.0, certain, {}, quiet, "missing")
    assert found.effects["spring"] == pytest.approx(sure(25, 11), abs=1e-4) == pytest.approx(0.983, abs=1e-3)
    assert found.unexplained == pytest.approx(1 - sure(25, 11))


def test_a_name_under_an_unexplained_verdict_is_even_at_most():
    """It and the cause of no catalogue explain the same, and nothing decides between them."""
    before = held_out(*[1.0] * 10)
    certain = {"spring": finding(before, held_out(*[0.5] * 10), "spring", p_value=1e-300)}
    assert joint_probabilities([], 4000.0, certain, {}, [], "unexplained").effects["spring"] == 0.5


def test_a_p_value_leaves_more_probability_than_it_is_itself():
    assert probability_left(0.01) == pytest.approx(0.1113, abs=1e-4)  # Sellke, Bayarri, Berger 2001, table 1
    assert probability_left(0.5) == 0.5
    assert probability_left(0.0) == pytest.approx(0.0, abs=1e-300)
