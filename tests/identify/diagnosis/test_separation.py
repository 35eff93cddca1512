"""What two rivals part by: algebra against drawn numbers."""

from __future__ import annotations

import numpy as np
import pytest

from identify.diagnosis.separation import expected_share, unfollowed


def test_the_expected_share_of_the_right_rival_is_that_of_its_odds_drawn():
    """Two models of like evidence: the logarithm of their odds has the mean d²/2 and the variance 2 d²."""
    assert expected_share(0.0) == pytest.approx(0.5)
    drawn = np.random.default_rng(1).standard_normal(400_000)
    for separation in (0.5, 2.0, 5.0):
        odds = separation**2 / 2 + np.sqrt(2) * separation * drawn
        assert expected_share(separation) == pytest.approx(np.mean(1 / (1 + np.exp(-odds))), abs=2e-3)
    assert expected_share(118.0) == pytest.approx(1.0)


def test_what_columns_leave_of_a_torque_stands_across_them_whatever_their_units():
    random = np.random.default_rng(2)
    columns, torque = random.standard_normal((40, 3)) * [1.0, 1e-9, 1e9], random.standard_normal(40)
    columns = np.column_stack([columns, np.zeros(40), 2.0 * columns[:, 0]])
    left = unfollowed(torque, columns)
    size = np.maximum(np.linalg.norm(columns, axis=0), 1e-300)
    np.testing.assert_allclose(columns.T @ left / size, 0.0, atol=1e-12)
    assert np.linalg.norm(unfollowed(columns[:, 0], columns)) < 1e-12
