"""Global least squares on factors against NumPy and SciPy on the rows themselves."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.linalg import lstsq

from identify.estimation.least_squares import least_squares
from identify.estimation.statistics import classical_deviation
from tests.identify.estimation.synthetic_observation import observation_of, single

seeds = st.integers(0, 2**32 - 1)


def random_problem(random, rows=200, columns=5):
    W = random.standard_normal((rows, columns)) * 10.0 ** random.uniform(-2, 2, columns)
    return W, W @ random.standard_normal(columns) + random.standard_normal(rows)


@given(seeds)
def test_one_joint_is_ordinary_least_squares_with_the_deviations_of_eq_13_to_15(seed):
    W, Y = random_problem(np.random.default_rng(seed))
    observation = single(W, Y)
    fit = least_squares(observation)
    expected, squares, _, _ = lstsq(W, Y)
    np.testing.assert_allclose(fit.chi, expected, rtol=1e-9)
    assert fit.residual[0] == pytest.approx(np.sqrt(squares))
    assert fit.relative_error == pytest.approx(np.sqrt(squares) / np.linalg.norm(Y))
    covariance = squares / (len(Y) - 5) * np.linalg.inv(W.T @ W)
    np.testing.assert_allclose(classical_deviation(fit), np.sqrt(np.diag(covariance)), rtol=1e-6)
    assert fit.condition_number == pytest.approx(np.linalg.cond(W / np.linalg.norm(W, axis=0)), rel=1e-6)


@given(seeds)
def test_given_weights_weigh_the_rows_of_their_joint(seed):
    random = np.random.default_rng(seed)
    (W1, Y1), (W2, Y2) = random_problem(random, columns=3), random_problem(random, columns=4)
    # the joints share the parameters 1 and 2
    columns = [np.array([0, 1, 2]), np.array([1, 2, 3, 4])]
    observation = observation_of([np.column_stack([W1, Y1]), np.column_stack([W2, Y2])], columns, 5)
    W = np.zeros((400, 5))
    W[:200, columns[0]], W[200:, columns[1]] = W1, W2
    weight = np.repeat([0.5, 3.0], 200)
    expected = lstsq(W * weight[:, None], np.concatenate([Y1, Y2]) * weight)[0]
    fit = least_squares(observation, weights=np.array([0.5, 3.0]))
    np.testing.assert_allclose(fit.chi, expected, rtol=1e-8)


def test_the_weights_found_are_the_inverse_deviations_of_the_joints():
    random = np.random.default_rng(5)
    chi = np.array([1.0, -2.0, 0.5])
    W1, W2 = random.standard_normal((4000, 3)), random.standard_normal((4000, 3))
    Y1 = W1 @ chi + 0.1 * random.standard_normal(4000)
    Y2 = W2 @ chi + 5.0 * random.standard_normal(4000)
    both = [np.column_stack([W1, Y1]), np.column_stack([W2, Y2])]
    fit = least_squares(observation_of(both, [np.arange(3)] * 2, 3))
    assert fit.weights[0] / fit.weights[1] == pytest.approx(50.0, rel=0.05)
    ordinary = least_squares(observation_of(both, [np.arange(3)] * 2, 3), weights=np.ones(2))
    assert np.linalg.norm(fit.chi - chi) < 0.2 * np.linalg.norm(ordinary.chi - chi)


def test_a_joint_that_is_fitted_to_rounding_weighs_as_one_fitted_to_a_millionth_of_its_torque():
    random = np.random.default_rng(6)
    W = random.standard_normal((400, 2))
    exact = np.column_stack([W, W @ [3000.0, -500.0]])
    noisy = np.column_stack([W, W @ [1.0, 2.0] + 0.1 * random.standard_normal(400)])
    fit = least_squares(observation_of([exact, noisy], [np.array([0, 1]), np.array([2, 3])], 4))
    np.testing.assert_allclose(
        fit.weights[0], np.sqrt(400) / (1e-6 * np.linalg.norm(exact[:, -1])), rtol=1e-9
    )
    np.testing.assert_allclose(fit.chi[:2], [3000.0, -500.0], rtol=1e-9)


@given(seeds, st.floats(-5, 5), st.floats(0.1, 5))
def test_a_column_made_up_of_those_before_it_is_dropped_and_nothing_else(seed, one, other):
    random = np.random.default_rng(seed)
    W, Y = random_problem(random)
    dependent = one * W[:, 1] / np.linalg.norm(W[:, 1]) + other * W[:, 3] / np.linalg.norm(W[:, 3])
    full = np.column_stack([W[:, :4], dependent, W[:, 4]])
    fit = least_squares(single(full, Y))
    assert fit.dropped.tolist() == [4]
    assert fit.chi[4] == 0.0
    np.testing.assert_allclose(fit.chi[[0, 1, 2, 3, 5]], lstsq(W, Y)[0], rtol=1e-8)


def test_a_column_of_zeros_is_dropped():
    W, Y = random_problem(np.random.default_rng(3))
    W[:, 2] = 0.0
    assert least_squares(single(W, Y)).dropped.tolist() == [2]


def test_some_columns_on_some_blocks_are_the_fit_of_those_rows():
    W, Y = random_problem(np.random.default_rng(4))
    fit = least_squares(single(W, Y, blocks=10), [0, 3], blocks=[2, 7])
    rows = np.r_[40:60, 140:160]
    np.testing.assert_allclose(fit.chi[[0, 3]], lstsq(W[np.ix_(rows, [0, 3])], Y[rows])[0], rtol=1e-9)
    assert fit.rows.tolist() == [40]
