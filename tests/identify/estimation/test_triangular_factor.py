"""Triangular factors stand for all rows, whatever the blocks and their order."""

from __future__ import annotations

import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from identify.estimation.triangular_factor import TriangularFactor


@st.composite
def blocks_of_rows(draw):
    """Blocks of random rows, some with fewer rows than columns, columns of very different size."""
    random = np.random.default_rng(draw(st.integers(0, 2**32 - 1)))
    columns = draw(st.integers(1, 8))
    scale = 10.0 ** random.uniform(-3, 3, columns)
    counts = draw(st.lists(st.integers(0, 60), min_size=1, max_size=6))
    if sum(counts) < 2 * columns:
        counts.append(2 * columns)
    return [random.standard_normal((count, columns)) * scale for count in counts], random


@given(blocks_of_rows())
def test_factors_merged_in_any_order_have_the_products_of_all_rows(drawn):
    blocks, random = drawn
    width = blocks[0].shape[1]
    everything = np.vstack(blocks)
    expected = everything.T @ everything
    factors = [TriangularFactor.of(block) for block in blocks]
    random.shuffle(factors)
    merged = TriangularFactor.merge(factors, width)
    size = np.sqrt(np.outer(np.diag(expected), np.diag(expected)))
    assert merged.rows == len(everything)
    assert np.all(np.abs(merged.gram() - expected) <= 1e-11 * size)


@given(blocks_of_rows())
def test_merging_pairwise_is_merging_at_once(drawn):
    blocks, _ = drawn
    width = blocks[0].shape[1]
    factors = [TriangularFactor.of(block) for block in blocks]
    pairwise = factors[0]
    for factor in factors[1:]:
        pairwise = TriangularFactor.merge([pairwise, factor], width)
    whole = TriangularFactor.merge(factors, width)
    np.testing.assert_allclose(pairwise.gram(), whole.gram(), rtol=1e-10, atol=1e-12 * whole.gram().max())
    assert pairwise.rows == whole.rows


@given(blocks_of_rows())
def test_the_solution_on_merged_factors_is_that_of_lstsq_on_all_rows(drawn):
    blocks, random = drawn
    norms = np.linalg.norm(np.vstack(blocks), axis=0)
    rows = [np.column_stack([block / norms, random.standard_normal(len(block))]) for block in blocks]
    merged = TriangularFactor.merge([TriangularFactor.of(part) for part in rows], rows[0].shape[1])
    everything = np.vstack(rows)
    expected = np.linalg.lstsq(everything[:, :-1], everything[:, -1], rcond=None)[0]
    found = np.linalg.lstsq(merged.r[:, :-1], merged.r[:, -1], rcond=None)[0]
    condition = np.linalg.cond(everything[:, :-1])
    assert np.linalg.norm(found - expected) <= 1e-13 * condition**2 * np.linalg.norm(everything[:, -1])


def test_selected_columns_are_those_of_the_rows():
    rows = np.random.default_rng(1).standard_normal((40, 5))
    factor = TriangularFactor.of(rows).select([3, 0])
    np.testing.assert_allclose(factor.gram(), rows[:, [3, 0]].T @ rows[:, [3, 0]], rtol=1e-12)


def test_nothing_merged_is_an_empty_factor_of_the_right_width():
    assert TriangularFactor.merge([], 4).r.shape == (0, 4)


@given(blocks_of_rows(), st.floats(1e-3, 1e3))
def test_scaled_rows_have_the_products_of_rows_each_multiplied_by_the_weight(drawn, weight):
    blocks, _ = drawn
    rows = np.vstack(blocks)
    scaled = TriangularFactor.of(rows).scaled(weight)
    expected = (weight * rows).T @ (weight * rows)
    assert np.all(np.abs(scaled.gram() - expected) <= 1e-11 * np.sqrt(np.outer(*[np.diag(expected)] * 2)))
    assert scaled.rows == len(rows)


def test_a_block_of_fewer_rows_than_columns_is_kept_and_one_of_no_rows_too():
    rows = np.arange(6.0).reshape(2, 3)
    factor = TriangularFactor.of(rows)
    np.testing.assert_array_equal(factor.r, rows)
    rows[:] = 0.0  # a copy is kept
    assert factor.r.any()
    nothing = TriangularFactor.merge([], 4)
    assert (nothing.r.shape, nothing.rows) == ((0, 4), 0)
    np.testing.assert_array_equal(factor.select([2, 0]).r, [[2.0, 0.0], [5.0, 3.0]])
    assert factor.select([1]).rows == 2
