"""Vectors whose components may be constants: the same numbers as NumPy's, and nothing computed for a 0 or a 1."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from identify.dynamics.constant_folding import (
    FrameChange,
    cross,
    difference,
    is_zero,
    matrix_times,
    negative,
    product,
    total,
    vector_sum,
)

SAMPLES = 3
COMPONENTS = st.one_of(
    st.sampled_from([0.0, 1.0, -1.0, 2.5]),
    st.lists(st.floats(-9, 9), min_size=SAMPLES, max_size=SAMPLES).map(np.array),
)
VECTORS = st.tuples(COMPONENTS, COMPONENTS, COMPONENTS)


def full(component):
    return np.broadcast_to(component, (SAMPLES,)).astype(float)


def stacked(vector):
    return np.column_stack([full(component) for component in vector])


@given(COMPONENTS, COMPONENTS)
def test_products_sums_and_differences_are_those_of_arrays(left, right):
    np.testing.assert_array_equal(full(product(left, right)), full(left) * full(right))
    np.testing.assert_array_equal(full(total(left, right)), full(left) + full(right))
    np.testing.assert_array_equal(full(difference(left, right)), full(left) - full(right))
    np.testing.assert_array_equal(full(negative(left)), -full(left))


@given(VECTORS, VECTORS)
def test_vectors_are_added_and_crossed_as_numpy_does(left, right):
    np.testing.assert_array_equal(stacked(vector_sum(left, right)), stacked(left) + stacked(right))
    np.testing.assert_allclose(
        stacked(cross(left, right)), np.cross(stacked(left), stacked(right)), atol=1e-12
    )


@given(st.tuples(VECTORS, VECTORS, VECTORS), VECTORS)
def test_a_matrix_of_columns_times_a_vector(columns, vector):
    matrix = np.stack([stacked(column) for column in columns], axis=2)
    expected = np.einsum("nij,nj->ni", matrix, stacked(vector))
    np.testing.assert_allclose(stacked(matrix_times(columns, vector)), expected, atol=1e-12)


def test_a_constant_0_or_1_costs_no_array():
    values = np.arange(3.0)
    assert is_zero(0.0)
    assert not is_zero(np.zeros(3))
    assert not is_zero(1.0)
    for zero in (product(0.0, values), product(values, 0.0), negative(0.0), total(0.0, 0.0)):
        assert is_zero(zero)
    for same in (product(1.0, values), product(values, 1.0), total(0.0, values), total(values, 0.0)):
        assert same is values
    assert difference(values, 0.0) is values


@given(alpha=st.floats(-4, 4), theta=st.floats(-4, 4), vector=VECTORS)
def test_a_change_of_frame_is_the_product_of_two_rotations(alpha, theta, vector):
    ca, sa, ct, st_ = np.cos(alpha), np.sin(alpha), np.cos(theta), np.sin(theta)
    about_x = np.array([[1, 0, 0], [0, ca, sa], [0, -sa, ca]])
    about_z = np.array([[ct, st_, 0], [-st_, ct, 0], [0, 0, 1]])
    expected = stacked(vector) @ (about_z @ about_x).T
    np.testing.assert_allclose(stacked(FrameChange(alpha, theta).into(vector)), expected, atol=1e-12)
    moving = FrameChange(alpha, np.full(SAMPLES, theta))
    np.testing.assert_allclose(stacked(moving.into(vector)), expected, atol=1e-12)


@pytest.mark.parametrize("quarter", [-2, -1, 1, 2, 3])
def test_right_angles_have_exact_zeros(quarter):
    change = FrameChange(quarter * np.pi / 2, 0.0)
    assert 0.0 in (change.cos_alpha, change.sin_alpha)
    assert (change.cos_theta, change.sin_theta) == (1.0, 0.0)
