"""Squared errors of every block and joint, and their ratio, against sums written out."""

from __future__ import annotations

import numpy as np
import pytest

from identify.estimation.block_errors import block_errors, ratio
from tests.identify.estimation.synthetic_observation import observation_of


def test_a_ratio_is_the_root_of_residual_over_measured():
    assert ratio(4.0, 100.0) == pytest.approx(0.2)
    assert ratio(0.0, 100.0) == 0.0
    assert ratio(1.0, 1e-12) == pytest.approx(1e6)
    assert ratio(1.0, 0.0) is None
    assert ratio(1.0, float("nan")) is None


def test_squared_norms_of_every_block_and_joint_are_those_of_the_rows():
    random = np.random.default_rng(3)
    W = random.standard_normal((90, 3))
    chi = np.array([1.0, -2.0, 0.5])
    Y = W @ chi + 0.1 * random.standard_normal(90)
    rows = [np.column_stack([W, Y]), np.column_stack([W[:, [1]], W[:, 1] * chi[1] + 0.3])]
    found = block_errors(observation_of(rows, [[0, 1, 2], [1]], 3, blocks=3), chi)
    expected = np.zeros((3, 2, 2))
    for block, part in enumerate(np.array_split(np.arange(90), 3)):
        residual = Y[part] - W[part] @ chi
        expected[block, 0] = residual @ residual, Y[part] @ Y[part]
        second = rows[1][part, -1]
        expected[block, 1] = 0.3**2 * len(part), second @ second
    np.testing.assert_allclose(found, expected, rtol=1e-10)
