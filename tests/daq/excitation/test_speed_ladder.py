"""The ladder of speeds: what it must show (slow and fast, both ways, all over the range) and what it must keep."""

import numpy as np
import pytest

from daq.excitation.excitation_plan import ExcitationPlan
from daq.excitation.speed_ladder import LADDERS, RUNGS, SHORTEST_CRUISE, Reach, speed_ladder

TWO = Reach(
    low=np.array([-1.2, -0.4]),
    high=np.array([1.9, 0.8]),
    velocity=np.array([1.2, 0.5]),
    acceleration=np.array([4.0, 3.0]),
    jerk=np.array([60.0, 40.0]),
)


def lasts(moves) -> float:
    return sum(move.duration for move in moves)


def motion(moves, start):
    plan = ExcitationPlan(joints=("a", "b")[: len(start)], start=tuple(start), phases=moves)
    return plan.evaluate(np.arange(0.0, plan.duration, 2e-3))


@pytest.mark.parametrize("seconds", [90.0, 180.0, 600.0])
def test_the_ladder_fills_its_time_and_comes_back_to_where_it_began(seconds):
    moves = speed_ladder(TWO, TWO.middle, seconds)
    assert 0.9 * seconds < lasts(moves) <= seconds
    np.testing.assert_allclose(moves[-1].to, TWO.middle)


def test_it_keeps_every_limit_and_uses_the_whole_range_and_the_top_speed():
    position, velocity, acceleration, jerk = motion(speed_ladder(TWO, TWO.middle, 180.0), TWO.middle)
    assert (position >= TWO.low - 1e-9).all()
    assert (position <= TWO.high + 1e-9).all()
    for term, limit in ((velocity, TWO.velocity), (acceleration, TWO.acceleration), (jerk, TWO.jerk)):
        assert (np.abs(term).max(axis=0) <= limit * (1 + 1e-9)).all()
    # joints move together: one of them at its own speed, the other perhaps a little below
    used = velocity.max(axis=0) / TWO.velocity
    assert used.max() == pytest.approx(1.0, rel=1e-3)
    assert used.min() > 0.9
    np.testing.assert_allclose(np.ptp(position, axis=0), TWO.high - TWO.low, rtol=0.02)


def test_every_rung_is_cruised_both_ways_for_a_while_and_slow_ones_at_three_places():
    one = Reach(*(getattr(TWO, name)[:1] for name in ("low", "high", "velocity", "acceleration", "jerk")))
    position, velocity, _, _ = motion(speed_ladder(one, one.middle, 300.0), one.middle)
    for rung in RUNGS:
        for sign in (1.0, -1.0):
            cruising = np.abs(velocity - sign * rung * one.velocity) < 1e-6
            assert cruising.sum() * 2e-3 > SHORTEST_CRUISE, (rung, sign)
    slow = (np.abs(np.abs(velocity) - RUNGS[0] * one.velocity) < 1e-6)[:, 0]
    share = (position[slow] - one.low) / (one.high - one.low)
    assert {0, 1, 2} == set(np.clip(np.floor(3 * share), 0, 2).astype(int).ravel())


def test_joints_do_not_run_in_parallel():
    _, velocity, _, _ = motion(speed_ladder(TWO, TWO.middle, 300.0), TWO.middle)
    assert abs(np.corrcoef(velocity.T)[0, 1]) < 0.7


def test_the_order_is_that_of_the_seed():
    first, again, other = (speed_ladder(TWO, TWO.middle, 180.0, seed) for seed in (1, 1, 2))
    assert first == again
    assert first != other


def test_where_time_is_short_rungs_are_left_out_and_the_shortest_ladder_stays_whole():
    shortest = speed_ladder(TWO, TWO.middle, 1.0)
    assert lasts(shortest) > 1.0
    _, velocity, _, _ = motion(shortest, TWO.middle)
    rungs, _ = LADDERS[-1]
    for rung in rungs:
        assert (np.abs(velocity[:, 0] - rung * TWO.velocity[0]) < 1e-6).any()
    missing = set(RUNGS) - set(rungs) - {0.8}
    assert not any(
        (np.abs(np.abs(velocity[:, 0]) - rung * TWO.velocity[0]) < 1e-6).sum() > 20 for rung in missing
    )


def test_the_reach_is_the_rig_s_limits_less_a_margin(rig):
    reach, limits = Reach.of(rig, margin=0.9, dynamic_share=0.5), rig.axes[0].limits
    low, high = limits.position
    assert reach.high[0] - reach.low[0] == pytest.approx(0.9 * (high - low))
    assert reach.middle[0] == pytest.approx((low + high) / 2)
    assert reach.velocity[0] == pytest.approx(0.45 * limits.velocity)
    assert reach.acceleration[0] == pytest.approx(0.45 * limits.acceleration)
    assert reach.jerk[0] == pytest.approx(0.45 * limits.jerk)
