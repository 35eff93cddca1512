"""Factors of blocks of time: what is merged, picked and summed of them is what the rows themselves give."""

from __future__ import annotations

import numpy as np
import pytest

from tests.identify.estimation.synthetic_observation import observation_of


@pytest.fixture(scope="module")
def rows() -> list[np.ndarray]:
    """Two joints; [W Y] of each, 47 samples in 5 blocks."""
    random = np.random.default_rng(6)
    return [random.normal(size=(47, 4)), random.normal(size=(47, 3))]


@pytest.fixture
def observation(rows):
    return observation_of(rows, [[0, 2, 4], [1, 2]], 5, blocks=5)


def gram(rows: np.ndarray) -> np.ndarray:
    """Of [W Y tau], tau alike Y in these observations."""
    whole = np.column_stack([rows, rows[:, -1]])
    return whole.T @ whole


@pytest.mark.parametrize("joint", [0, 1])
def test_merged_blocks_have_the_products_of_their_rows(observation, rows, joint):
    whole = observation.merged(joint)
    np.testing.assert_allclose(whole.gram(), gram(rows[joint]), rtol=1e-10)
    assert whole.rows == 47
    assert observation.merged(joint) is whole  # computed once
    parts = np.array_split(rows[joint], 5)
    some = observation.merged(joint, [3, 1])
    np.testing.assert_allclose(some.gram(), gram(np.vstack([parts[1], parts[3]])), rtol=1e-10)
    assert some.rows == len(parts[1]) + len(parts[3])


def test_no_block_has_no_rows(observation):
    nothing = observation.merged(0, [])
    assert nothing.r.shape == (0, 5)
    assert nothing.rows == 0


def test_columns_are_found_where_they_stand_on_a_joints_rows_and_left_out_elsewhere(observation):
    assert observation.on_rows(0, np.array([4, 1, 0])).tolist() == [2, 0]
    assert observation.on_rows(1, np.array([2, 4])).tolist() == [1]
    assert observation.on_rows(1, np.array([7])).tolist() == []  # of another observation's candidates
    assert observation.width == 5


def test_blocks_belong_to_their_sessions(rows):
    two = observation_of(rows, [[0, 1, 2], [0, 1]], 3, blocks=6, sessions=2)
    assert [two.blocks_of(session) for session in (0, 1, 2)] == [[0, 1, 2], [3, 4, 5], []]


def test_stacked_factors_are_those_of_the_blocks_and_sums_stay_inside_a_block(observation, rows):
    before = [factors[0].gram() for factors in observation.factors]
    stacked = observation.stacked(0)
    for block, parts in enumerate(stacked.of_blocks([0, 2])):
        np.testing.assert_allclose(parts.T @ parts, before[block][np.ix_([0, 2], [0, 2])], rtol=1e-10)
    squares = stacked.sums(stacked.rows**2)
    np.testing.assert_allclose(squares, [np.diag(each) for each in before], rtol=1e-10)
    assert stacked.block.tolist() == sorted(stacked.block.tolist())
    assert np.bincount(stacked.block).tolist() == np.diff(stacked.edges).tolist()
    # what the blocks hold is the same memory from now on
    stacked.rows[0, 0] = 123.0
    assert observation.factors[0][0].r[0, 0] == 123.0


def test_a_block_without_rows_sums_to_nothing(rows):
    cut = [rows[0][:3]]
    observation = observation_of(cut, [[0, 1, 2]], 3, blocks=5)  # 3 samples in 5 blocks
    sums = observation.stacked(0).sums(np.ones((3, 1)))
    assert sums[:, 0].tolist() == [1.0, 1.0, 1.0, 0.0, 0.0]
