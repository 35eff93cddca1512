"""Limits checked on samples: motions of known velocity and acceleration, in blocks of any size."""

import itertools
import re

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from daq.rig import Rig
from daq.safety import LimitMonitor, StopCause, StopReason
from daq.samples import CAME_AGAIN, COMMAND_CAME, POSITION_CAME, SYNC_NOT_SEEN, Phase, sample_dtype
from daq.torque_offset import SentAhead

ENABLED = 0x1237


def rows_of(rig: Rig, position: np.ndarray) -> np.ndarray:
    """Rows of one axis that follows its setpoint exactly, moving, enabled, complete."""
    rows = np.zeros(len(position), sample_dtype(1))
    rows["cycle"] = np.arange(len(position))
    rows["sync_time"] = np.rint(rows["cycle"] * rig.cycle * 1e9)
    rows["phase"] = Phase.PLAN
    counts = np.rint((position - rig.position_offset[0]) / rig.position_matrix[0, 0])
    rows["position"][:, 0] = rows["setpoint"][:, 0] = counts
    rows["status"] = ENABLED
    rows["valid"] = POSITION_CAME | COMMAND_CAME
    rows["temperature"] = np.nan
    return rows


def verdict(rig: Rig, rows: np.ndarray, cuts=()) -> StopReason | None:
    monitor = LimitMonitor(rig)
    edges = sorted({0, len(rows), *(cut % (len(rows) + 1) for cut in cuts)})
    for start, end in itertools.pairwise(edges):
        reason = monitor.check(rows[start:end])
        if reason is not None:
            return reason
    return None


def time_of(rig: Rig, seconds: float) -> np.ndarray:
    return np.arange(0.0, seconds, rig.cycle)


@settings(max_examples=60, deadline=None)
@given(speed=st.floats(0.05, 3.0), cuts=st.lists(st.integers(0, 500), max_size=8))
def test_a_constant_speed_is_stopped_exactly_when_it_is_beyond_the_limit_and_its_margin(rig, speed, cuts):
    limit = rig.axes[0].limits.velocity * rig.supervision.velocity_margin
    time = time_of(rig, 0.6)
    rows = rows_of(rig, 0.1 + speed * (time - 0.3))
    reason = verdict(rig, rows, cuts)
    if abs(speed - limit) > 0.01:
        assert (reason is not None) == (speed > limit)
    if reason is not None:
        assert reason.cause is StopCause.LIMIT
        assert "joint j3: velocity" in reason.words


@settings(max_examples=60, deadline=None)
@given(acceleration=st.floats(0.5, 20.0), cuts=st.lists(st.integers(0, 500), max_size=8))
def test_a_constant_acceleration_is_stopped_exactly_when_it_is_beyond_the_limit_and_its_margin(
    rig, acceleration, cuts
):
    limit = rig.axes[0].limits.acceleration * rig.supervision.acceleration_margin
    time = time_of(rig, 0.1)
    reason = verdict(rig, rows_of(rig, 0.5 * acceleration * time**2), cuts)
    if abs(acceleration - limit) > 0.2:
        assert (reason is not None) == (acceleration > limit)
    if reason is not None:
        assert "acceleration" in reason.words


def test_nothing_is_judged_at_standstill_without_power_and_nothing_filled_in_where_nothing_came(rig):
    time = time_of(rig, 0.2)
    rows = rows_of(rig, 5.0 * time)
    rows["phase"] = Phase.STANDSTILL
    held = verdict(rig, rows)
    assert "velocity of the held axis 5 rad/s above 0.36 rad/s" in held.words
    rows["status"] = 0x0250  # SWITCH ON DISABLED: moved by hand
    assert verdict(rig, rows) is None
    rows = rows_of(rig, 0.1 * time)
    rows["position"][50] = 2**30
    rows["valid"][50] = COMMAND_CAME
    assert verdict(rig, rows) is None


def test_a_sample_that_is_a_cycle_old_is_not_taken_for_a_jump(rig):
    rows = rows_of(rig, 1.1 * (time_of(rig, 0.6) - 0.3))
    rows["position"][100] = rows["position"][99]
    assert verdict(rig, rows) is None


def late_stamps(seed: int, rows: np.ndarray, lateness: float) -> None:
    """Stamps as of a process that is often late: most by little, some by several milliseconds."""
    late = np.random.default_rng(seed).exponential(lateness, len(rows))
    rows["sync_time"] += np.rint(late * 1e9).astype(np.int64)


def swing(rig: Rig, velocity: float, acceleration: float, seconds: float = 2.0) -> np.ndarray:
    """A sinusoid with these shares of the velocity and acceleration limits at its peaks."""
    limits = rig.axes[0].limits
    rate = acceleration * limits.acceleration / (velocity * limits.velocity)
    return 0.1 + velocity * limits.velocity / rate * np.sin(rate * time_of(rig, seconds))


def on_the_machine(rig: Rig, cycle: float) -> Rig:
    """The rig as a real one, whose rows have the stamps of a clock."""
    return rig.model_copy(update={"simulated": None, "cycle": cycle})


@settings(max_examples=40, deadline=None)
@given(seed=st.integers(0, 1000), cycle=st.sampled_from([0.001, 0.002, 0.005]))
def test_stamps_that_are_milliseconds_late_are_not_taken_for_accelerations(rig, seed, cycle):
    real = on_the_machine(rig, cycle)
    rows = rows_of(real, swing(real, 1.0, 1.0))
    late_stamps(seed, rows, 0.002)
    assert verdict(real, rows) is None


@settings(max_examples=20, deadline=None)
@given(seed=st.integers(0, 1000), cycle=st.sampled_from([0.001, 0.002, 0.005]))
def test_a_motion_that_is_too_fast_is_found_however_late_the_stamps(rig, seed, cycle):
    real = on_the_machine(rig, cycle)
    too_fast = rows_of(real, swing(real, 1.25, 1.0))
    too_hard = rows_of(real, swing(real, 0.8, 3.0))
    for rows in (too_fast, too_hard):
        late_stamps(seed, rows, 0.0005)
    assert "velocity" in verdict(real, too_fast).words
    assert "acceleration" in verdict(real, too_hard).words


def test_a_clock_that_is_set_back_during_the_motion_is_no_reason(rig):
    real = on_the_machine(rig, 0.002)
    rows = rows_of(real, swing(real, 1.0, 1.0))
    rows["sync_time"][400:] -= 3_600_000_000_000
    assert verdict(real, rows) is None
    rows = rows_of(real, swing(real, 1.3, 1.0))
    rows["sync_time"][400:] -= 3_600_000_000_000
    assert "velocity" in verdict(real, rows).words


@pytest.mark.parametrize("cycle", [0.001, 0.002, 0.005])
@pytest.mark.parametrize("behind", [1, 3])
def test_answers_that_fall_behind_by_cycles_and_catch_up_are_not_taken_for_accelerations(rig, cycle, behind):
    """At full speed. Rows lack while answers fall behind, and hold several when they catch up."""
    slow = rig.model_copy(update={"cycle": cycle})
    rows = rows_of(slow, 1.2 * (time_of(slow, 1.2) - 0.3))
    told = rows["position"].copy()
    rows["position"][100 + behind : 150] = told[100 : 150 - behind]
    rows["valid"][100 : 100 + behind] = COMMAND_CAME
    rows["valid"][150] |= CAME_AGAIN
    assert verdict(slow, rows) is None
    rows["valid"][:] = POSITION_CAME | COMMAND_CAME
    if behind == 3:
        assert verdict(slow, rows) is not None, "without the marks it is a jump"


def changed(rows: np.ndarray, name: str, value: float, first: int = 100) -> np.ndarray:
    rows[name][first:] = value
    return rows


@pytest.mark.parametrize(
    ("change", "cause", "words"),
    [
        (lambda rig, rows: changed(rows, "command", 3100), StopCause.LIMIT, r"current 18\.\d+ A above 18 A"),
        (
            lambda rig, rows: changed(rows, "temperature", 91.0),
            StopCause.LIMIT,
            "temperature 91.0 °C above 80",
        ),
        (
            lambda rig, rows: changed(rows, "setpoint", 10**6),
            StopCause.LIMIT,
            "following error .* above 0.05",
        ),
        (lambda rig, rows: changed(rows, "status", 0x0218), StopCause.DRIVE_FAULT, "it is in FAULT"),
        (lambda rig, rows: changed(rows, "valid", COMMAND_CAME), StopCause.SILENT_DRIVE, "no position from"),
        (
            lambda rig, rows: changed(rows, "valid", POSITION_CAME | COMMAND_CAME | SYNC_NOT_SEEN),
            StopCause.LOST_SYNC,
            "no SYNC was seen",
        ),
    ],
    ids=["current", "temperature", "following error", "fault", "silence", "lost SYNC"],
)
def test_each_limit_has_its_reason_in_words_and_the_cycle(rig, change, cause, words):
    rows = change(rig, rows_of(rig, np.zeros(300)))
    monitor = LimitMonitor(rig)
    assert monitor.check(rows[:100]) is None
    reason = monitor.check(rows[100:])
    assert reason.cause is cause
    assert reason.status == "faulted"
    assert re.search(words, reason.words), reason.words
    assert re.search(r"in cycle 1\d\d$", reason.words)


def test_a_position_outside_its_limits_by_more_than_the_following_error_is_stopped(rig):
    highest = rig.axes[0].limits.position[1]
    slack = rig.axes[0].limits.following_error
    assert verdict(rig, rows_of(rig, np.full(50, highest + 0.9 * slack))) is None
    assert "position" in verdict(rig, rows_of(rig, np.full(50, highest + 1.1 * slack))).words


def test_every_cause_is_complete_aborted_or_faulted():
    statuses = {cause: cause.status for cause in StopCause}
    assert [cause for cause, status in statuses.items() if status == "complete"] == [StopCause.PLAN_DONE]
    aborted = {cause for cause, status in statuses.items() if status == "aborted"}
    assert aborted == {StopCause.OPERATOR, StopCause.DEAD_PARENT}


@settings(max_examples=40, deadline=None)
@given(behind=st.floats(-2e-3, 2e-3), cuts=st.lists(st.integers(0, 300), max_size=6))
def test_an_axis_that_must_follow_closely_is_held_against_where_it_should_have_arrived(rig, behind, cuts):
    """At any speed: the way of a cycle, which the newest setpoint is ahead, is no error."""
    within, speed = 1e-3, 0.8
    time = time_of(rig, 0.4)
    rows = rows_of(rig, 0.1 + speed * time)
    arrives = rows_of(rig, 0.1 + speed * (time - rig.cycle) + behind)
    rows["position"] = arrives["position"]
    unknown = np.full((len(rows), 1), np.nan)
    monitor = LimitMonitor(rig, SentAhead(np.zeros((len(rows), 1), np.int16), np.array([within]), unknown))
    edges = sorted({0, len(rows), *(cut % (len(rows) + 1) for cut in cuts)})
    reasons = [monitor.check(rows[start:end]) for start, end in itertools.pairwise(edges)]
    told = next((reason for reason in reasons if reason is not None), None)
    if abs(abs(behind) - within) > 5e-5:
        assert (told is not None) == (abs(behind) > within)
    if told is not None:
        assert told.cause is StopCause.LIMIT
        assert "following error grows" in told.words


@settings(max_examples=30, deadline=None)
@given(missing=st.integers(1, 40), cuts=st.lists(st.integers(0, 300), max_size=8))
@pytest.mark.parametrize(
    ("lost", "cause"),
    [
        (COMMAND_CAME, StopCause.SILENT_DRIVE),
        (POSITION_CAME | COMMAND_CAME | SYNC_NOT_SEEN, StopCause.LOST_SYNC),
    ],
)
def test_silence_counts_as_it_lasts_however_the_rows_come_in(rig, lost, cause, missing, cuts):
    """To the cycle: one fewer is no reason, whatever was silent before and has spoken since."""
    bound = round(rig.supervision.silence / rig.cycle)
    rows = rows_of(rig, np.zeros(300))
    rows["valid"][50 : 50 + bound - 1] = lost
    assert verdict(rig, rows, cuts) is None
    rows["valid"][150 : 150 + missing] = lost
    reason = verdict(rig, rows, cuts)
    assert (reason is not None) == (missing >= bound)
    if reason is not None:
        assert reason.cause is cause
        assert reason.words.endswith(f"for {rig.supervision.silence:g} s in cycle {150 + bound - 1}")


def test_a_drive_that_falls_silent_while_it_stops_is_no_second_reason(rig):
    rows = rows_of(rig, np.zeros(300))
    rows["valid"][100:] = COMMAND_CAME
    rows["phase"] = Phase.STOPPING
    assert verdict(rig, rows) is None
    rows["phase"][:50] = Phase.APPROACH
    rows["valid"][:50] = COMMAND_CAME
    reason = verdict(rig, rows)
    assert reason is not None
    assert reason.cause is StopCause.SILENT_DRIVE
