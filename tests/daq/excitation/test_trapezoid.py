"""Moves with a trapezoidal velocity keep their limits and waste none."""

import numpy as np
import pytest
from pydantic import ValidationError

from daq.excitation.trapezoid import Dwell, Move, move_at

VELOCITY, ACCELERATION, JERK = np.array([1.0, 2.0]), np.array([4.0, 4.0]), np.array([60.0, 60.0])


@pytest.mark.parametrize("to", [(1.5, 0.2), (0.02, -0.01), (0.3, 3.0)])
def test_a_move_stays_within_every_limit_and_reaches_one(to):
    start = np.zeros(2)
    move = move_at(start, np.array(to), VELOCITY, ACCELERATION, JERK)
    time = np.linspace(0.0, move.duration, 4001)
    position, *rates = move.evaluate(time, start)
    np.testing.assert_allclose(position[[0, -1]], [start, to], atol=1e-12)
    shares = [
        np.abs(rate).max(axis=0) / limit
        for rate, limit in zip(rates, (VELOCITY, ACCELERATION, JERK), strict=True)
    ]
    assert np.max(shares) == pytest.approx(1.0, abs=2e-3)


def test_all_joints_begin_and_end_together():
    move = move_at(np.zeros(2), np.array([1.5, 0.2]), VELOCITY, ACCELERATION, JERK)
    half = move.evaluate(np.array([0.5 * move.duration]), np.zeros(2))[0]
    np.testing.assert_allclose(half, [[0.75, 0.1]], atol=1e-12)


def test_a_move_to_where_it_starts_is_refused():
    with pytest.raises(ValueError, match="start and end are the same"):
        move_at(np.ones(2), np.ones(2), VELOCITY, ACCELERATION, JERK)


def test_flanks_longer_than_the_move_are_refused():
    with pytest.raises(ValidationError, match="two flanks of"):
        Move(to=(1.0,), duration=1.0, ramp=0.6)


def test_a_dwell_stands_still():
    position, *rates = Dwell(duration=1.0).evaluate(np.linspace(0, 1, 5), np.array([0.3, -0.2]))
    assert (position == [0.3, -0.2]).all()
    assert not np.any(rates)
