"""The plan of a proposed experiment: what was asked for, within the rig's limits."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as some

from daq.excitation.plan_limits import violations
from daq.excitation.separating_plan import SeparatingMotion, separating_plan
from daq.rig import Rig
from identify.recording.errors import InputError

ONE = Rig.load("rx130l-joint3-simulated")
SIX = Rig.load("tx40-simulated")


def moved(plan, joint: int) -> np.ndarray:
    """(N,) positions of a joint every 2 ms."""
    return plan.setpoints(np.arange(0.0, plan.duration, 0.002)).position[:, joint]


@pytest.mark.parametrize("shape", ["sinusoid", "trapezoid"])
def test_the_joint_moves_between_the_two_positions_as_often_as_asked_at_the_speed_asked(shape):
    motion = SeparatingMotion(shape=shape, speed=0.3, position_from=-0.2, position_to=0.4, repeats=4)
    plan, remarks = separating_plan(ONE, "j3", motion, np.zeros(1), "test")
    position = moved(plan, 0)
    assert remarks == ()
    assert position.min() == pytest.approx(-0.2, abs=2e-3)
    assert position.max() == pytest.approx(0.4, abs=2e-3)
    velocity = plan.setpoints(np.arange(0.0, plan.duration, 0.002)).velocity[:, 0]
    assert np.abs(velocity).max() == pytest.approx(0.3, rel=0.02)
    middle = np.flatnonzero(np.diff(np.sign(position - 0.1)) > 0)
    assert len(middle) >= 4


def test_what_the_rig_cannot_reach_is_cut_and_said():
    limits = ONE.axes[0].limits
    motion = SeparatingMotion(shape="trapezoid", speed=50.0, position_from=-9.0, position_to=9.0, repeats=1)
    plan, remarks = separating_plan(ONE, "j3", motion, np.zeros(1), "test")
    position = moved(plan, 0)
    assert limits.position[0] <= position.min() < position.max() <= limits.position[1]
    assert "further the rig's limits do not let it" in remarks[0]
    assert "instead of 50 rad/s" in remarks[1]


def test_the_other_joints_rest_where_they_stood():
    limits = np.array([axis.limits.position for axis in SIX.axes])
    posture = limits @ [0.4, 0.6]
    motion = SeparatingMotion(shape="sinusoid", speed=0.4, position_from=-0.9, position_to=-0.5, repeats=3)
    plan, _ = separating_plan(SIX, "j2", motion, posture, "test")
    rows = plan.setpoints(np.arange(0.0, plan.duration, 0.01)).position
    still = [joint for joint in range(6) if joint != 1]
    assert np.abs(rows[:, still] - posture[still]).max() < 1e-12
    assert np.ptp(rows[:, 1]) == pytest.approx(0.4, rel=0.02)


def test_a_joint_or_a_range_that_the_rig_does_not_have_is_named():
    motion = SeparatingMotion(shape="sinusoid", speed=0.4, position_from=7.0, position_to=8.0, repeats=3)
    with pytest.raises(InputError, match="cannot move between 7 and 8"):
        separating_plan(ONE, "j3", motion, np.zeros(1), "test")
    with pytest.raises(InputError, match="has no joint j9; it has j3"):
        separating_plan(ONE, "j9", motion, np.zeros(1), "test")


@given(
    shape=some.sampled_from(["sinusoid", "trapezoid"]),
    speed=some.floats(0.2, 30.0),
    low=some.floats(-2.0, 1.5),
    distance=some.floats(0.01, 3.0),
    repeats=some.integers(1, 8),
)
@settings(max_examples=30, deadline=None)
def test_no_proposal_breaks_a_limit(shape, speed, low, distance, repeats):
    motion = SeparatingMotion(
        shape=shape, speed=speed, position_from=low, position_to=low + distance, repeats=repeats
    )
    try:
        plan, _ = separating_plan(ONE, "j3", motion, np.zeros(1), "test")
    except InputError:
        return  # nothing of it lies within the range
    times = np.linspace(0.0, plan.duration, 20_000)
    assert violations(plan, ONE, times=times) == []
