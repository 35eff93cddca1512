"""What a motion makes a joint do, of motions with a known share of each."""

from __future__ import annotations

import numpy as np
import pytest

from identify.effects.coverage import Coverage, JointLimits

DQ = np.array([0.0, 0.0, 1.0, 0.5, 0.09, 0.09, -0.05, -1.0, -0.4, 0.1, -0.02, 0.3])
"""two samples at rest, ten in motion; slow is below 0.1"""
STEADY = np.zeros(12)


def test_slow_motion_is_below_a_tenth_of_the_top_speed_by_direction():
    found = Coverage.of(np.zeros(12), DQ, STEADY)
    assert (found.slow_forwards, found.slow_backwards) == (0.2, 0.2)
    assert (found.forwards, found.backwards) == (0.6, 0.4)
    assert (found.fast, found.top_speed_share, found.position_share, found.quadrants) == (None,) * 4


@pytest.mark.parametrize(("rate", "slow"), [(0.89, 0.2), (0.9, 0.0), (0.91, 0.0)])
@pytest.mark.parametrize("sign", [1, -1])
def test_a_slow_speed_must_last_a_tenth_of_a_second_at_its_rate_of_change(rate, slow, sign):
    ddq = np.full(12, sign * rate)
    ddq[10] = ddq[6] = 0.0
    found = Coverage.of(np.zeros(12), DQ, ddq)
    assert found.slow_forwards == slow
    assert found.slow_backwards == 0.2


def test_fast_and_wide_are_shares_of_what_the_limits_allow():
    found = Coverage.of(np.linspace(-0.5, 1.0, 12), DQ, STEADY, limits=JointLimits((-1.0, 3.0), 2.0))
    assert found.fast == pytest.approx(0.2)  # above 0.35 · 2: both of speed 1
    assert found.top_speed_share == 0.5
    assert found.position_share == pytest.approx(1.5 / 4)
    at = Coverage.of(np.zeros(12), DQ, STEADY, limits=JointLimits((-1.0, 3.0), 0.4 / 0.35))
    assert at.fast == pytest.approx(0.3)  # 1, 1 and 0.5; 0.4 is at the bound


def test_quadrants_are_counted_from_both_forwards_on():
    load = np.array([9.0, 9.0, 1.0, 1.0, 1.0, -1.0, 1.0, 1.0, -1.0, -1.0, -1.0, 0.0])
    found = Coverage.of(np.zeros(12), DQ, STEADY, load)
    assert found.quadrants == pytest.approx((0.3, 0.2, 0.2, 0.2))
    half = Coverage.of(np.zeros(2), np.array([0.5, -0.5]), np.zeros(2), np.array([1.0, 1.0]))
    assert half.quadrants == (0.5, 0.5, 0.0, 0.0)


def test_a_joint_that_rests_does_nothing():
    found = Coverage.of(np.zeros(3), np.zeros(3), np.zeros(3), np.ones(3), JointLimits((0.0, 1.0), 1.0))
    assert found == Coverage(0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, (0.0, 0.0, 0.0, 0.0))
