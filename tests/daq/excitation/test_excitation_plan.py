"""Excitation plans: closed forms, limits, files."""

import itertools
import json

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from daq.excitation import (
    Dwell,
    ExcitationPlan,
    Move,
    Sinusoids,
    approach,
    require_within_limits,
    standard_plan,
    violations,
)
from daq.excitation.trapezoid import move_at
from daq.rig import Rig
from identify.recording.errors import InputError


@pytest.fixture(scope="module")
def rig() -> Rig:
    return Rig.load("rx130l-joint3-simulated")


@pytest.fixture(scope="module")
def plan(rig) -> ExcitationPlan:
    return standard_plan(rig, 60.0)


def two_joint_plan() -> ExcitationPlan:
    return ExcitationPlan(
        name="two",
        joints=("a", "b"),
        start=(0.1, -0.2),
        phases=(
            Dwell(duration=0.2),
            Move(to=(0.5, -0.6), duration=1.0, ramp=0.3),
            Sinusoids(
                frequency=0.5,
                repeats=2,
                fade=1.0,
                centre=(0.5, -0.6),
                cosine=((0.1, 0.05), (0.0, 0.02)),
                sine=((0.02, 0.0), (0.1, -0.05)),
            ),
            Move(to=(0.0, 0.0), duration=0.8, ramp=0.4),
        ),
    )


def test_velocity_acceleration_and_jerk_are_the_derivatives_of_the_position():
    plan = two_joint_plan()
    step = 1e-4
    times = np.arange(0.0, plan.duration, step)
    values = plan.evaluate(times)
    for lower, upper in itertools.pairwise(values):
        numeric = (lower[2:] - lower[:-2]) / (2.0 * step)
        assert np.abs(numeric - upper[1:-1]).max() < 2e-3 * np.abs(upper).max()


def test_position_velocity_and_acceleration_have_no_jump_and_rest_at_both_ends(plan):
    times = np.linspace(0.0, plan.duration, 60001)
    step = times[1]
    position, velocity, acceleration, jerk = plan.evaluate(times)
    for lower, upper in ((position, velocity), (velocity, acceleration), (acceleration, jerk)):
        assert np.abs(np.diff(lower, axis=0)).max() <= 1.05 * step * np.abs(upper).max()
    for ends in (velocity, acceleration, jerk):
        assert np.abs(ends[[0, -1]]).max() == 0.0


def test_the_repeated_stretch_repeats_exactly(plan):
    ((begin, end, period),) = plan.repeated
    repeats = round((end - begin) / period)
    assert repeats >= 2
    time = np.linspace(begin, begin + period, 500, endpoint=False)
    first = plan.setpoints(time).position
    for k in range(1, repeats):
        assert np.abs(plan.setpoints(time + k * period).position - first).max() < 1e-9


def test_a_plan_file_reproduces_the_trajectory_to_the_last_bit(plan, tmp_path):
    path = tmp_path / "plan.json"
    path.write_text(plan.to_json(), encoding="utf-8")
    times = np.arange(0.0, plan.duration, 0.002)
    for written, read in zip(plan.evaluate(times), ExcitationPlan.load(path).evaluate(times), strict=True):
        assert np.array_equal(written, read)


def test_setpoints_do_not_depend_on_which_times_are_asked_together(plan):
    times = np.arange(0.0, plan.duration, 0.002)
    whole = plan.setpoints(times).position
    for k in (0, 1234, len(times) - 1):
        assert plan.setpoints(times[k : k + 1]).position[0] == pytest.approx(whole[k], abs=1e-12)


def test_the_standard_plan_keeps_every_limit_and_the_time(rig, plan):
    assert violations(plan, rig) == []
    assert 55.0 < plan.duration <= 60.0


def test_the_standard_plan_has_speeds_from_one_percent_to_the_limit_both_ways_over_the_range(rig, plan):
    limits = rig.axes[0].limits
    times = np.arange(0.0, plan.duration, 0.001)
    position, velocity, acceleration = (values[:, 0] for values in plan.setpoints(times))
    cruising = np.abs(acceleration) < 1e-9
    for share in (0.01, 0.035, 0.1, 0.35):
        for direction in (1.0, -1.0):
            near = cruising & (np.abs(velocity * direction - share * 0.98 * limits.velocity) < 1e-6)
            assert np.count_nonzero(near) > 300, (share, direction)
            assert np.ptp(position[near]) > 0.8 * (limits.position[1] - limits.position[0]) * (1 - share)
    assert np.abs(velocity).max() > 0.95 * limits.velocity
    assert position.min() < limits.position[0] + 0.05
    assert position.max() > limits.position[1] - 0.05


def test_a_plan_beyond_a_limit_is_refused_with_joint_time_and_value(rig):
    plan = ExcitationPlan(
        name="too fast",
        joints=("j3",),
        start=(0.0,),
        phases=(Move(to=(1.0,), duration=1.0, ramp=0.5),),
    )
    with pytest.raises(
        InputError,
        match=r"joint j3: acceleration 7\.5 rad/s² at 0\.250 s is beyond the limit of 4 rad/s² \(and 1",
    ):
        require_within_limits(plan, rig)
    found = {violation.quantity for violation in violations(plan, rig)}
    assert found == {"velocity", "acceleration"}


def test_a_predicted_torque_beyond_the_current_limit_is_refused(rig, plan):
    times = np.arange(0.0, plan.duration, 0.01)
    torque = np.full((len(times), 1), 100.0)
    torque[700] = -700.0
    (found,) = violations(plan, rig, torque, times)
    assert found.quantity == "predicted current"
    assert found.time == pytest.approx(7.0)
    assert found.value == pytest.approx(-700.0 / 35.15)


def test_a_plan_for_another_robot_is_refused(rig):
    with pytest.raises(InputError, match=r"joints \(a, b\) are not those of rig"):
        violations(two_joint_plan(), rig)


def test_a_damaged_plan_file_is_refused_with_file_and_field(plan, tmp_path):
    path = tmp_path / "plan.json"
    path.write_text(plan.to_json().replace('"duration"', '"durations"', 1), encoding="utf-8")
    with pytest.raises(InputError, match=r"plan\.json: phases\.0"):
        ExcitationPlan.load(path)
    with pytest.raises(InputError, match="No such file"):
        ExcitationPlan.load(tmp_path / "none.json")


@pytest.mark.parametrize(
    ("change", "said"),
    [
        ({"name": "n" * 256}, r"name: String should have at most 255 characters"),
        ({"name": "swing\u202e"}, r"name: holds the character U\+202E, which is not shown"),
        ({"rig": "a\nb"}, r"rig: holds the character U\+000A"),
        ({"joints": ["j3\0"]}, r"joints\.0: holds the character U\+0000"),
    ],
)
def test_names_in_a_plan_file_are_bounded_as_others_are(plan, tmp_path, change, said):
    path = tmp_path / "plan.json"
    path.write_text(json.dumps({**json.loads(plan.to_json()), **change}), encoding="utf-8")
    with pytest.raises(InputError, match=rf"^\S+plan\.json: {said}"):
        ExcitationPlan.load(path)


def test_the_approach_leads_slowly_to_the_start(rig, plan):
    move = approach(rig, np.array([1.5]), np.array(plan.start))
    assert move is not None
    assert violations(move, rig) == []
    position, velocity, _ = move.setpoints(np.linspace(0.0, move.duration, 1001))
    assert position[-1] == pytest.approx(plan.start)
    assert np.abs(velocity).max() <= 0.2 * rig.axes[0].limits.velocity
    assert approach(rig, np.array(plan.start), np.array(plan.start)) is None


@pytest.mark.parametrize(
    ("content", "words"),
    [
        ("{]", ", line 1: not JSON"),
        ("[" * 200_000, ": no plan: lists too deep within each other"),
        (f'{{"format": {"9" * 5000}}}', ": no plan: .* a number of too many digits"),
    ],
    ids=["broken", "deep", "long"],
)
def test_a_file_that_is_no_plan_is_refused_in_one_line(tmp_path, content, words):
    (tmp_path / "plan.json").write_text(content)
    with pytest.raises(InputError, match=f"plan.json{words}") as refused:
        ExcitationPlan.load(tmp_path / "plan.json")
    assert "\n" not in str(refused.value)


finite = st.floats(-3.0, 3.0).map(lambda x: round(x, 4))
limit = st.floats(0.05, 50.0)


@given(st.lists(st.tuples(finite, finite, limit, limit, limit), min_size=1, max_size=4))
@settings(max_examples=200, deadline=None)
def test_the_quickest_move_reaches_a_limit_and_breaks_none(rows):
    start, to, velocity, acceleration, jerk = (np.array(column) for column in zip(*rows, strict=True))
    if np.array_equal(start, to):
        return
    move = move_at(start, to, velocity, acceleration, jerk)
    time = np.linspace(0.0, move.duration, 4001)
    _, *derivatives = move.evaluate(time, start)
    shares = [
        np.abs(d).max(axis=0) / bound
        for d, bound in zip(derivatives, (velocity, acceleration, jerk), strict=True)
    ]
    assert np.max(shares) <= 1.0 + 1e-6
    assert np.max(shares) > 0.98
    assert move.evaluate(time[-1:], start)[0][0] == pytest.approx(to)
