"""Evidence for columns against SciPy's F distribution and the sandwich written out."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.stats import f as f_distribution

from identify.diagnosis.evidence import group_evidence, joined_influences, wald_p_value
from tests.identify.estimation.synthetic_observation import single

BLOCKS = 24
ROWS = 20


def made(strength: float, seed: int = 0):
    """Columns a, b, c of which b and c are to be judged beside a; Y holds b by its strength."""
    random = np.random.default_rng(seed)
    W = random.standard_normal((BLOCKS * ROWS, 3)) * np.array([1.0, 4.0, 0.5])
    return W, 2.0 * W[:, 0] + strength * W[:, 1] + random.standard_normal(BLOCKS * ROWS)


def sandwich(W, Y, blocks):
    """Least squares and the cluster-robust covariance with each block as a cluster, n / (n − 1)."""
    gram = W.T @ W
    chi = np.linalg.solve(gram, W.T @ Y)
    left = Y - W @ chi
    scores = np.array(
        [w.T @ r for w, r in zip(np.array_split(W, blocks), np.array_split(left, blocks), strict=True)]
    )
    influence = np.linalg.solve(gram, scores.T).T
    return chi, influence


@pytest.mark.parametrize("strength", [0.0, 0.05, 0.3])
@pytest.mark.parametrize("extra", [[1], [1, 2]])
def test_the_p_value_is_the_f_test_s_of_the_least_favourable_joining_of_blocks(strength, extra):
    W, Y = made(strength)
    observation = single(W, Y, BLOCKS)
    columns = [0, *extra]
    chi, influence = sandwich(W[:, columns], Y, BLOCKS)
    k, worst, deviations = len(extra), 0.0, []
    for size in (1, 2):  # four would leave six groups
        n = BLOCKS // size
        together = influence[:, 1:].reshape(n, size, k).sum(axis=1)
        covariance = together.T @ together * n / (n - 1)
        strength_of = chi[1:] @ np.linalg.solve(covariance, chi[1:])
        statistic = strength_of / k * (n - k) / (n - 1)
        worst = max(worst, f_distribution.sf(statistic, k, n - k))
        deviations.append(np.sqrt(np.sum(together**2, axis=0)))
    found = group_evidence(observation, 0, np.array([0]), np.array(extra))
    assert found.p_value == pytest.approx(worst, rel=1e-6)
    np.testing.assert_allclose(found.estimates, chi[1:], rtol=1e-8)
    if k == 1:
        np.testing.assert_allclose(found.deviations, np.max(deviations, axis=0), rtol=1e-6)


def test_columns_that_the_joint_does_not_have_or_the_base_holds_are_no_evidence():
    W, Y = made(0.3)
    W = np.column_stack([W, W[:, 0]])
    observation = single(W, Y, BLOCKS)
    nothing = group_evidence(observation, 0, np.array([0]), np.array([9]))
    assert nothing.p_value == 1.0
    assert len(nothing.estimates) == 0
    same = group_evidence(observation, 0, np.array([0]), np.array([3]))
    assert same.p_value == 1.0
    assert same.estimates.tolist() == [0.0]
    assert np.isnan(same.deviations).all()


def test_without_a_base_the_column_stands_alone():
    W, Y = made(0.3)
    found = group_evidence(single(W, Y, BLOCKS), 0, np.array([], int), np.array([1]))
    np.testing.assert_allclose(found.estimates, [W[:, 1] @ Y / (W[:, 1] @ W[:, 1])], rtol=1e-9)


def test_neighbouring_blocks_of_a_session_are_joined_while_enough_are_left():
    influence = np.arange(48.0).reshape(48, 1)
    one, two, four = joined_influences(influence, np.zeros(48, int))
    np.testing.assert_array_equal(one, influence)
    np.testing.assert_array_equal(two[:, 0], influence.reshape(24, 2).sum(axis=1))
    np.testing.assert_array_equal(four[:, 0], influence.reshape(12, 4).sum(axis=1))
    # twelve groups at least
    assert len(joined_influences(influence[:44], np.zeros(44, int))) == 2
    assert len(joined_influences(influence[:6], np.zeros(6, int))) == 1


def test_as_many_blocks_as_estimates_tell_nothing():
    influence = np.array([[1.0, 0.0], [0.0, 1.0], [1.0, 1.0]])
    assert wald_p_value(np.array([100.0, 100.0]), [influence]) == 1.0
    four = np.vstack([influence, [1.0, -1.0]])
    n, k = 4, 2
    covariance = four.T @ four * n / (n - 1)
    value = np.array([3.0, 5.0])
    statistic = value @ np.linalg.solve(covariance, value) / k * (n - k) / (n - 1)
    assert wald_p_value(value, [four]) == pytest.approx(f_distribution.sf(statistic, k, n - k))


def test_a_column_of_rounding_has_no_estimate_and_takes_none_from_the_others():
    W, Y = made(0.3)
    alone = group_evidence(single(W, Y, BLOCKS), 0, np.array([0]), np.array([1]))
    rounding = 1e-134 * np.random.default_rng(2).standard_normal(len(W))
    both = group_evidence(
        single(np.column_stack([W, rounding]), Y, BLOCKS), 0, np.array([0]), np.array([1, 3])
    )
    np.testing.assert_allclose(both.estimates, [*alone.estimates, 0.0])
    np.testing.assert_allclose(both.deviations, [*alone.deviations, np.nan])
    assert both.p_value == pytest.approx(alone.p_value)
