"""Interpolation against polynomials, which it has to reproduce, and at the samples themselves."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from identify.recording.interpolation import interpolate, previous

STEPS = st.lists(st.floats(0.05, 2.0), min_size=5, max_size=12)


@given(steps=STEPS, coefficients=st.lists(st.floats(-3, 3), min_size=4, max_size=4), seed=st.integers(0, 99))
def test_cubics_and_straight_lines_are_reproduced_between_uneven_samples_and_a_little_beyond(
    steps, coefficients, seed
):
    old = np.cumsum(steps)
    new = np.random.default_rng(seed).uniform(old[0] - 0.1, old[-1] + 0.1, 20)
    cubic, line = np.polynomial.Polynomial(coefficients), np.polynomial.Polynomial(coefficients[:2])
    values = np.column_stack([cubic(old), line(old)])
    np.testing.assert_allclose(interpolate(old, values, new, True)[:, 0], cubic(new), rtol=1e-6, atol=1e-6)
    np.testing.assert_allclose(interpolate(old, values, new, False)[:, 1], line(new), rtol=1e-9, atol=1e-9)


@given(steps=STEPS, cubic=st.booleans(), seed=st.integers(0, 99))
def test_at_a_sample_its_own_value_stands_exactly(steps, cubic, seed):
    old = np.cumsum(steps)
    values = np.random.default_rng(seed).normal(size=(len(old), 2))
    np.testing.assert_array_equal(interpolate(old, values, old, cubic), values)


def test_a_cubic_takes_the_two_samples_on_either_side():
    """A value far away has no say: the interpolation is local."""
    old = np.arange(10.0)
    values = np.zeros((10, 1))
    values[7] = 1.0
    at = interpolate(old, values, np.array([4.5, 5.5, 6.5]), True)[:, 0]
    assert at[0] == 0.0
    assert at[1] == pytest.approx(-1 / 16)
    assert at[2] == pytest.approx(9 / 16)


@pytest.mark.parametrize("count", [1, 2, 3])
def test_few_samples_take_the_polynomial_that_they_allow(count):
    old = np.arange(float(count))
    values = (2.0 + 3.0 * old)[:, None]
    expected = 2.0 if count == 1 else 3.5
    assert interpolate(old, values, np.array([0.5]), True)[0, 0] == pytest.approx(expected)


def test_the_previous_value_is_that_of_the_newest_sample_not_after():
    old, values = np.array([1.0, 2.0, 4.0]), np.array(["a", "b", "c"])
    found = previous(old, values, np.array([0.5, 1.0, 1.9, 2.0, 3.9, 4.0, 9.0]))
    assert found.tolist() == ["a", "a", "a", "b", "b", "c", "c"]
