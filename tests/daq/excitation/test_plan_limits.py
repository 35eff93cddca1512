"""A plan against the limits: moves whose peaks are known in closed form, each just inside and just beyond."""

import numpy as np
import pytest

from daq.excitation.excitation_plan import ExcitationPlan
from daq.excitation.plan_limits import require_within_limits, sampling_times, violations, without_repeats
from daq.excitation.sinusoid import Sinusoids
from daq.excitation.trapezoid import Move
from identify.recording.errors import InputError

START, TO = 0.0, 1.0
MOVE = Move(to=(TO,), duration=2.0, ramp=0.5)


@pytest.fixture
def plan() -> ExcitationPlan:
    return ExcitationPlan(name="there", joints=("j3",), start=(START,), phases=(MOVE,))


@pytest.fixture
def limited(rig):
    """The rig with limits that the plan keeps by far, but for what is given."""

    def make(**limits):
        wide = {"position": (-9.0, 9.0), "velocity": 99.0, "acceleration": 999.0, "jerk": 1e6, "current": 1e4}
        axis = rig.axes[0]
        changed = axis.model_copy(update={"limits": axis.limits.model_copy(update=wide | limits)})
        return rig.model_copy(update={"axes": (changed,)})

    return make


def peaks(plan):
    return [float(np.abs(term).max()) for term in plan.evaluate(sampling_times(plan))]


@pytest.mark.parametrize(
    ("quantity", "which", "unit"),
    [("velocity", 1, "rad/s"), ("acceleration", 2, "rad/s²"), ("jerk", 3, "rad/s³")],
)
def test_a_plan_may_touch_a_limit_and_not_pass_it(plan, limited, quantity, which, unit):
    peak = peaks(plan)[which]
    assert violations(plan, limited(**{quantity: peak})) == []
    (broken,) = violations(plan, limited(**{quantity: 0.999 * peak}))
    assert (broken.joint, broken.quantity, broken.unit) == ("j3", quantity, unit)
    assert abs(broken.value) == pytest.approx(peak)
    assert abs(broken.limit) == pytest.approx(0.999 * peak)
    value = np.abs(plan.evaluate(np.array([broken.time]))[which]).max()
    assert value == pytest.approx(peak, rel=1e-6)


def test_the_velocity_of_a_trapezoid_is_way_over_time_without_the_ramps(plan):
    assert peaks(plan)[1] == pytest.approx((TO - START) / (MOVE.duration - MOVE.ramp))


@pytest.mark.parametrize(("position", "limit", "time"), [((-9.0, 0.9), 0.9, 2.0), ((0.1, 9.0), 0.1, 0.0)])
def test_either_end_of_the_range_is_a_limit(plan, limited, position, limit, time):
    (broken,) = violations(plan, limited(position=position))
    assert (broken.quantity, broken.limit, broken.unit) == ("position", limit, "rad")
    assert broken.time == pytest.approx(time, abs=1e-3)


def test_a_predicted_torque_is_a_current_by_the_drive_gain(plan, limited):
    gain = limited().drive_gain[0, 0]
    times = np.array([0.0, 1.0, 2.0])
    torque = gain * np.array([[1.0], [-8.0], [2.0]])
    assert violations(plan, limited(current=8.0), torque, times) == []
    (broken,) = violations(plan, limited(current=7.9), torque, times)
    assert str(broken) == "joint j3: predicted current -8 A at 1.000 s is beyond the limit of -7.9 A"


def test_the_refusal_names_the_first_in_time_and_counts_the_others(plan, limited):
    require_within_limits(plan, limited())
    with pytest.raises(
        InputError, match=r"plan there: joint j3: acceleration .* at 0.250 s .* \(and 2 more\)$"
    ):
        require_within_limits(plan, limited(velocity=0.1, acceleration=0.1, jerk=0.1))
    with pytest.raises(InputError, match=r"^plan there: joint j3: velocity [^(]*$"):
        require_within_limits(plan, limited(velocity=0.1))


def test_a_plan_for_another_robot_is_refused(limited):
    other = ExcitationPlan(name="other", joints=("j1",), start=(0.0,), phases=(MOVE,))
    with pytest.raises(InputError, match=r"its joints \(j1\) are not those of rig .* \(j3\)"):
        violations(other, limited())


def test_a_plan_is_looked_at_each_millisecond_both_ends_included(plan):
    times = sampling_times(plan)
    assert (times[0], times[-1]) == (0.0, plan.duration)
    assert np.diff(times).max() <= 0.001 + 1e-12
    assert len(times) == 2001


def test_one_period_of_what_repeats_shows_all_that_the_others_would():
    swing = Sinusoids(frequency=0.5, repeats=20, fade=1.0, centre=(0.2,), cosine=((0.1,),), sine=((0.3,),))
    plan = ExcitationPlan(name="swing", joints=("j3",), start=(0.2,), phases=(swing,))
    every = sampling_times(plan)
    seen = without_repeats(plan, every)
    assert len(seen) < len(every) / 8
    assert (seen[0], seen[-1]) == (0.0, plan.duration)
    for all_of_them, these in zip(plan.evaluate(every), plan.evaluate(seen), strict=True):
        assert np.abs(these).max() == pytest.approx(np.abs(all_of_them).max(), rel=1e-5)
