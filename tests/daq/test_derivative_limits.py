"""Velocity and acceleration against their limits: by how much, from which row on, and what is no motion."""

from __future__ import annotations

import numpy as np
import pytest

from daq.derivative_limits import LASTING, DerivativeLimits, excess_in_words
from daq.rig import Rig

ROWS = 400


class Axis:
    """Feeds one axis row by row or in blocks; everything came, everything is judged, both clocks agree."""

    def __init__(self, rig: Rig) -> None:
        self.rig = rig
        limits = rig.axes[0].limits
        self.speed = limits.velocity * rig.supervision.velocity_margin
        self.acceleration = limits.acceleration * rig.supervision.acceleration_margin
        self.window = max(1, round(rig.supervision.window / rig.cycle))
        self.resolution = float(np.abs(rig.position_matrix).sum())
        self.time = np.arange(ROWS) * rig.cycle

    def check(self, position, *, clocks=None, judged=None, held=None, lacking=None, again=None, block=ROWS):
        limits = DerivativeLimits(self.rig)
        flags = np.zeros((ROWS, 1), bool)
        stamps = np.column_stack([self.time, self.time]) if clocks is None else clocks
        for start in range(0, ROWS, block):
            part = slice(start, start + block)
            excesses = limits.check(
                stamps[part],
                np.asarray(position, float)[part, None],
                flags[part] if lacking is None else lacking[part, None],
                flags[part] if again is None else again[part, None],
                np.ones(ROWS, bool)[part] if judged is None else judged[part],
                np.zeros(ROWS, bool)[part] if held is None else held[part],
            )
            if excesses:
                return [(start + each.row, each.words) for each in excesses]
        return []


@pytest.fixture
def axis(rig: Rig) -> Axis:
    return Axis(rig)


def moving_from(axis: Axis, row: int, speed: float) -> np.ndarray:
    """At rest up to a row, from there on at a constant speed (an acceleration without bound)."""
    return np.maximum(np.arange(ROWS) - row, 0) * axis.rig.cycle * speed


def test_values_are_written_with_as_many_digits_as_tell_them_from_their_limit():
    assert excess_in_words(18.0003, 18.0, "A") == "18.0003 A above 18 A"
    assert excess_in_words(2.5, 2.0, "rad/s") == "2.5 rad/s above 2 rad/s"
    assert excess_in_words(2.00001234, 2.0, "rad/s") == "2.00001 rad/s above 2 rad/s"
    assert excess_in_words(np.nextafter(2.0, 3.0), 2.0, "m/s").startswith("2.0000000000000004 m/s above")


@pytest.mark.parametrize("block", [ROWS, 1, 7])
def test_a_speed_is_judged_over_the_window_with_a_count_at_either_end(axis, block):
    """Limit, margin and the rounding of a count over the window: on either side of their sum."""
    rounding = axis.resolution / (axis.window * axis.rig.cycle)
    fast, just = axis.speed + 1.01 * rounding, axis.speed + 0.99 * rounding
    assert axis.check(just * axis.time, block=block) == []
    (found,) = axis.check(fast * axis.time, block=block)
    assert found[0] == axis.window + LASTING - 1
    assert found[1].startswith("velocity ")
    assert found[1].endswith(f"above {axis.rig.axes[0].limits.velocity:g} rad/s")
    (backwards,) = axis.check(-fast * axis.time, block=block)
    assert backwards[0] == found[0]


@pytest.mark.parametrize("block", [ROWS, 5])
def test_an_acceleration_is_judged_over_two_windows(axis, block):
    """½ a t² has the same difference of velocities everywhere; four counts over the window squared are rounding."""
    span = axis.window * axis.rig.cycle
    rounding = 4 * axis.resolution / span**2
    for share, stopped in ((0.99, False), (1.01, True)):
        a = axis.acceleration + share * rounding
        # nothing comes any more once it is nearly too fast
        position = np.where(a * axis.time < 0.9 * axis.speed, 0.5 * a * axis.time**2, np.nan)
        found = axis.check(position, block=block)
        assert bool(found) is stopped
        if stopped:
            assert found[0][0] == 2 * axis.window + LASTING - 1
            assert found[0][1].startswith("acceleration ")
            assert found[0][1].endswith("rad/s²")


def test_one_wrong_sample_and_two_are_no_motion_and_three_are(axis):
    """Beyond the limit in three rows in a row: a wrong sample is seen at both ends of a window."""
    for wrong, stopped in ((1, False), (2, False), (3, True)):
        position = np.zeros(ROWS)
        position[200 : 200 + wrong] = 10.0
        found = axis.check(position)
        assert bool(found) is stopped
        if stopped:
            assert min(row for row, _ in found) == 202


def test_rows_that_are_not_judged_count_for_the_differences_only(axis):
    position = moving_from(axis, 100, 2 * axis.speed)
    judged = np.zeros(ROWS, bool)
    assert axis.check(position, judged=judged) == []
    judged[300:] = True
    assert min(row for row, _ in axis.check(position, judged=judged)) == 302


def test_a_held_axis_may_go_no_faster_than_its_approach(axis):
    limit = axis.rig.axes[0].limits.velocity * axis.rig.supervision.approach_speed
    rounding = axis.resolution / (axis.window * axis.rig.cycle)
    judged, held = np.zeros(ROWS, bool), np.ones(ROWS, bool)
    assert axis.check((limit + 0.99 * rounding) * axis.time, judged=judged, held=held) == []
    ((row, words),) = axis.check((limit + 1.01 * rounding) * axis.time, judged=judged, held=held)
    assert row == axis.window + LASTING - 1
    assert words.startswith("velocity of the held axis ")
    assert words.endswith(f"above {limit:g} rad/s")
    # held for the last of the rows only
    held[: ROWS - 10] = False
    assert axis.check(2 * limit * axis.time, judged=judged, held=held)[0][0] == ROWS - 10 + LASTING - 1


def test_what_is_too_fast_by_one_clock_alone_is_the_clock(axis):
    speed = 1.3 * axis.speed
    half_as_fast = np.column_stack([axis.time, 2 * axis.time])
    assert axis.check(0.5 * speed * axis.time) == []
    assert axis.check(speed * axis.time, clocks=half_as_fast) == []
    assert axis.check(speed * axis.time, clocks=half_as_fast[:, ::-1]) == []
    assert axis.check(speed * axis.time)


def test_a_clock_that_stands_or_goes_back_says_nothing(axis):
    """At least half of the window's cycles have passed, whatever the stamps say: that alone is twice the speed."""
    standing = np.zeros((ROWS, 2))
    rounding = axis.resolution / (axis.window * axis.rig.cycle)
    assert axis.check(0.499 * axis.speed * axis.time, clocks=standing) == []
    found = axis.check((0.51 * axis.speed + rounding) * axis.time, clocks=standing)
    assert found[0][1].startswith("velocity ")


def test_answers_that_lack_and_come_again_explain_as_many_cycles_of_motion(axis):
    """A drive that answers a cycle late, and catches up: the step of a cycle's way is not a speed."""
    speed = 0.97 * axis.speed
    position = speed * axis.time
    late = position.copy()
    late[100:150] -= speed * axis.rig.cycle
    lacking, again = np.zeros(ROWS, bool), np.zeros(ROWS, bool)
    lacking[100] = again[150] = True
    assert axis.check(late, lacking=lacking, again=again) == []
    assert axis.check(late, lacking=lacking, again=again, block=3) == []
    two = position.copy()
    two[100:150] -= 4 * speed * axis.rig.cycle
    assert axis.check(two)
    lacking[100:104] = True
    assert axis.check(two, lacking=lacking, again=again) == []
    assert axis.check(two, lacking=lacking, again=again, block=3) == []


def test_what_came_again_explains_no_more_than_what_had_lacked(axis):
    """A jump of four cycles' way after nothing lacked is a jump."""
    speed = 0.97 * axis.speed
    position = speed * axis.time
    position[200:] += 4 * speed * axis.rig.cycle
    again = np.zeros(ROWS, bool)
    again[200] = True
    assert axis.check(position, again=again)
    lacking = np.zeros(ROWS, bool)
    lacking[120:124] = True
    again[:] = False
    again[130] = True  # has caught up then
    again[200] = True
    assert axis.check(position, lacking=lacking, again=again)
    again[130] = False
    assert axis.check(position, lacking=lacking, again=again) == []


def test_a_block_shorter_than_the_window_is_judged_with_those_that_follow(axis):
    fast = 2 * axis.speed * axis.time
    assert axis.check(fast, block=1)[0][0] == axis.check(fast)[0][0]


@pytest.mark.parametrize("block", [ROWS, 1])
def test_of_six_axes_the_one_that_is_too_fast_is_named(block):
    rig = Rig.load("tx40-simulated")
    axes, fast = len(rig.axes), 3
    too_fast = 1.2 * rig.axes[fast].limits.velocity * rig.supervision.velocity_margin
    time = np.arange(ROWS) * rig.cycle
    position = np.zeros((ROWS, axes))
    position[:, fast] = too_fast * time
    limits, none = DerivativeLimits(rig), np.zeros((ROWS, axes), bool)
    found = [
        excess
        for start in range(0, ROWS, block)
        for excess in limits.check(
            np.column_stack([time, time])[start : start + block],
            position[start : start + block],
            none[start : start + block],
            none[start : start + block],
            np.ones(ROWS, bool)[start : start + block],
            np.zeros(ROWS, bool)[start : start + block],
        )
    ]
    assert {each.axis for each in found} == {fast}
    assert found[0].words.startswith("velocity ")
