"""Least squares inside what parameters can be, against SciPy's own bounded solver."""

from __future__ import annotations

import numpy as np
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.optimize import lsq_linear

from identify.diagnosis.held_out import _inside
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


@settings(max_examples=60, deadline=None)
@given(seed=st.integers(0, 10_000), count=st.integers(1, 2))
def test_one_or_two_columns_need_no_general_solver(seed, count):
    columns, target, bounds = problem(seed, count)
    inner, product = columns.T @ columns, columns.T @ target
    free = np.linalg.solve(inner, product)
    if bounds.violation(free) > 0:
        expected = lsq_linear(columns, target, (bounds.lower, bounds.upper), method="bvls").x
        np.testing.assert_allclose(_inside(inner, product, free, bounds), expected, atol=1e-6)


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
