"""Least squares inside what parameters can be, against SciPy's own bounded solver."""

from __future__ import annotations

import numpy as np
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.optimize import lsq_linear

from identify.diagnosis.option_fits import Remainder, fit_options
from identify.effects.admissible import Admissible
from identify.estimation.constrained import nearest_admissible


def problem(seed: int, count: int) -> tuple[np.ndarray, np.ndarray, Admissible]:
    """Columns, target, and a range for some of the parameters."""
    random = np.random.default_rng(seed)
    lower = np.where(random.random(count) < 0.7, 0.0, -np.inf)
    upper = np.where(random.random(count) < 0.3, 0.5, np.inf)
    bounds = Admissible(lower, upper, np.zeros((0, count)), np.zeros(0))
    return random.normal(size=(20, count)), 3 * random.normal(size=20), bounds


@settings(max_examples=60, deadline=None)
@given(seed=st.integers(0, 10_000), count=st.integers(1, 8))
def test_the_values_are_those_of_a_bounded_least_squares(seed, count):
    columns, target, bounds = problem(seed, count)
    free = np.linalg.lstsq(columns, target, rcond=None)[0]
    found = nearest_admissible(np.linalg.qr(columns, mode="r"), free, bounds)
    expected = lsq_linear(columns, target, (bounds.lower, bounds.upper), method="bvls").x
    np.testing.assert_allclose(found, expected, atol=1e-5)
    # what is held at a bound is said of parameters that are at it: a rounding beside it would not be
    for bound in (bounds.lower, bounds.upper):
        near = np.abs(found - bound) < 1e-9
        np.testing.assert_array_equal(found[near], bound[near])


@settings(max_examples=60, deadline=None)
@given(seed=st.integers(0, 10_000), count=st.integers(1, 5), options=st.integers(1, 4))
def test_many_options_fitted_at_once_are_bounded_least_squares_each(seed, count, options):
    columns, target, _ = problem(seed, count * options)
    limits = [problem(seed + 1 + index, count)[2] for index in range(options)]
    rows = np.column_stack([columns, target])
    products = rows.T @ rows
    nothing = np.zeros((1, 0, len(products)))
    whole = Remainder(lambda one, other: products[one, other][None], nothing, nothing)
    places = [np.arange(count) + count * index for index in range(options)]
    found = fit_options(whole, whole, places, limits)
    for index, own in enumerate(places):
        expected = lsq_linear(
            columns[:, own], target, (limits[index].lower, limits[index].upper), method="bvls"
        )
        np.testing.assert_allclose(found.error[0, index], 2 * expected.cost, rtol=1e-6)
        np.testing.assert_allclose(
            found.gain[0, index], target @ target - 2 * expected.cost, rtol=1e-6, atol=1e-6
        )
        share = columns[:, own] @ expected.x
        np.testing.assert_allclose(found.power[0, index], share @ share, rtol=1e-4, atol=1e-6)


def test_a_relation_between_parameters_holds_and_costs_the_least():
    random = np.random.default_rng(3)
    columns, target = random.normal(size=(40, 3)), 5 * random.normal(size=40)
    free = np.linalg.lstsq(columns, target, rcond=None)[0]
    row = np.array([[1.0, 1.0, 0.0]])
    least = np.array([float((row @ free)[0]) + 1.0])
    wide = np.full(3, np.inf)
    found = nearest_admissible(np.linalg.qr(columns, mode="r"), free, Admissible(-wide, wide, row, least))
    inverse = np.linalg.inv(columns.T @ columns)
    moved = inverse @ row.T @ (1.0 / (row @ inverse @ row.T))  # Lagrange's multiplier for one relation
    np.testing.assert_allclose(found, free + moved[:, 0], atol=1e-6)
