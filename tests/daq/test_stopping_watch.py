"""Axes that were commanded to stop: motions of known speed, each beyond one of the watch's bounds, or just inside it."""

import numpy as np
import pytest

from daq.rig import Rig
from daq.samples import COMMAND_CAME, POSITION_CAME, Phase, sample_dtype
from daq.stopping_watch import REACTION, StoppingWatch
from tests.daq.rig_variants import with_limits

QUICK_STOP_ACTIVE = 0x0007
ENABLED = 0x0027
BEFORE = 100
"""rows at constant speed before the axis is commanded to stop"""


def rows_of(rig: Rig, position: np.ndarray, status: int = QUICK_STOP_ACTIVE) -> np.ndarray:
    rows = np.zeros(len(position), sample_dtype(1))
    rows["cycle"] = np.arange(len(position))
    rows["phase"] = Phase.STOPPING
    rows["position"][:, 0] = np.rint((position - rig.position_offset[0]) / rig.position_matrix[0, 0])
    rows["status"] = status
    rows["valid"] = POSITION_CAME | COMMAND_CAME
    return rows


def judged(rig: Rig, rows: np.ndarray, block: int = 7) -> tuple[str, float]:
    """What the watch says of the rows behind BEFORE, and how long after the command, s."""
    watch = StoppingWatch(rig)
    watch.remember(rows[:BEFORE])
    watch.begin()
    for first in range(BEFORE, len(rows), block):
        watch.remember(rows[first : first + block])
        words = watch.judge(rows[first : first + block])
        if words:
            return words, (min(first + block, len(rows)) - BEFORE) * rig.cycle
    return "", len(rows) * rig.cycle


def braking(
    rig: Rig, speed: float, deceleration: float, reaction: float = 0.0, seconds: float = 1.0
) -> np.ndarray:
    """Positions of an axis that goes at a speed (rad/s), then after `reaction` s brakes to rest."""
    time = np.arange(-BEFORE, round(seconds / rig.cycle)) * rig.cycle
    since = np.clip(time - reaction, 0.0, abs(speed) / deceleration)
    ramp = np.minimum(time, reaction) * speed + np.sign(speed) * (
        abs(speed) * since - 0.5 * deceleration * since**2
    )
    return np.asarray(ramp)


@pytest.fixture
def stating(rig):
    """The rig with a stated deceleration of its quick stop."""

    def make(deceleration: float) -> Rig:
        axis = rig.axes[0]
        limits = axis.limits.model_copy(update={"quick_stop_deceleration": deceleration})
        return rig.model_copy(update={"axes": (axis.model_copy(update={"limits": limits}),)})

    return make


@pytest.mark.parametrize("speed", [-1.2, 0.05, 0.6, 1.2])
def test_an_axis_that_brakes_on_its_ramp_is_left_alone(rig, speed):
    ramp = 0.5 * rig.axes[0].limits.acceleration
    for reaction in (0.0, REACTION):
        assert judged(rig, rows_of(rig, braking(rig, speed, ramp, reaction)))[0] == ""


def test_the_ramp_is_that_of_the_drive_where_one_is_stated(rig, stating):
    slow = rows_of(rig, braking(rig, 1.2, 0.8, seconds=2.0))
    assert judged(stating(0.8), slow)[0] == ""
    words, after = judged(stating(8.0), slow)
    assert "after it was commanded to stop" in words
    assert after < 0.3


@pytest.mark.parametrize("speed", [1.2, -1.2])
def test_an_axis_that_goes_on_at_its_speed_is_seen_when_the_ramp_has_left_it_behind(rig, speed):
    words, after = judged(rig, rows_of(rig, braking(rig, speed, 4.0, reaction=5.0)), block=1)
    limits, supervision = rig.axes[0].limits, rig.supervision
    # the ramp begins after the reaction, and from the speed that an axis may have won until the drive took the command
    window = max(2, round(supervision.window / rig.cycle)) * rig.cycle
    won = limits.acceleration * supervision.acceleration_margin * (window + 2 * rig.cycle)
    expected = REACTION + 3 * rig.cycle + won / (0.5 * limits.acceleration)
    assert after == pytest.approx(expected, abs=5 * rig.cycle)
    assert words.startswith("joint j3 turns at 1.2 rad/s ")
    assert "is the most that a quick stop leaves" in words


def test_one_wrong_sample_is_no_motion(rig):
    position = braking(rig, 0.0 + 1e-9, 4.0)
    rows = rows_of(rig, position)
    window = max(2, round(rig.supervision.window / rig.cycle))
    rows["position"][BEFORE + 20, 0] += 4000
    assert window > 3
    words, _ = judged(rig, rows[: BEFORE + 22], block=1)
    assert words == ""


def test_an_axis_that_runs_away_is_seen_at_half_more_than_its_velocity_limit(rig):
    # so large a margin that an axis might win more than that by its own acceleration
    rig = rig.model_copy(
        update={"supervision": rig.supervision.model_copy(update={"acceleration_margin": 10.0})}
    )
    limit = rig.axes[0].limits.velocity
    time = np.arange(-BEFORE, 200) * rig.cycle
    runaway = np.where(time < 0, limit * time, limit * time + 0.5 * 40.0 * time**2)
    words, after = judged(rig, rows_of(rig, runaway), block=1)
    window = max(2, round(rig.supervision.window / rig.cycle)) * rig.cycle
    # the speed over the window lags by half of it; three rows beyond the bound are awaited
    assert after == pytest.approx(0.5 * limit / 40.0 + window / 2 + 3 * rig.cycle, abs=3 * rig.cycle)
    assert f"{1.5 * limit:.3g} rad/s is the most" in words


def test_a_drive_that_stays_enabled_does_not_take_the_stop(rig):
    rows = rows_of(rig, np.zeros(BEFORE + 200), ENABLED)
    words, after = judged(rig, rows, block=1)
    assert words == "joint j3: the drive does not take the quick stop, it is still in OPERATION ENABLED"
    assert after == pytest.approx(REACTION + 3 * rig.cycle + 0.05, abs=2 * rig.cycle)


def test_a_statusword_that_did_not_come_says_nothing(rig):
    rows = rows_of(rig, np.zeros(BEFORE + 200), ENABLED)
    rows["valid"][BEFORE:] = POSITION_CAME
    assert judged(rig, rows)[0] == ""


def test_a_drive_that_falls_silent_is_named_with_how_long(rig):
    rows = rows_of(rig, np.zeros(BEFORE + 200))
    rows["valid"][BEFORE + 10 :] = COMMAND_CAME
    words, after = judged(rig, rows, block=1)
    assert words.startswith("joint j3: no position came for 0.0")
    silence = max(rig.supervision.silence, 5 * rig.cycle)
    assert after == pytest.approx(10 * rig.cycle + silence, abs=2 * rig.cycle)


def test_a_creeping_axis_is_seen_by_its_way(rig):
    """Slower than the floor of the speed, and yet it does not rest: its way is beyond that of a quick stop."""
    creep = 0.1 * rig.axes[0].limits.velocity * 0.9
    position = np.concatenate([np.zeros(BEFORE), creep * np.arange(4000) * rig.cycle])
    assert judged(rig, rows_of(rig, position))[0] == ""
    words, _ = judged(
        rig, rows_of(rig, np.concatenate([position[:BEFORE], position[BEFORE:] + 0.5])), block=1
    )
    assert words.endswith("a quick stop takes less")
    assert words.startswith("joint j3 went 0.5")


def test_a_speed_beyond_the_floor_is_no_rest(rig):
    speed = 0.15 * rig.axes[0].limits.velocity
    words, _ = judged(rig, rows_of(rig, braking(rig, speed, 4.0, reaction=5.0)))
    assert words.startswith(f"joint j3 turns at {speed:.3g} rad/s")


def test_an_encoder_that_flickers_by_two_counts_is_at_rest_however_slow_the_axis_is_allowed_to_be(rig):
    slow = with_limits(rig, velocity=4e-4)
    rows = rows_of(slow, np.zeros(BEFORE + 500))
    window = round(slow.supervision.window / slow.cycle)
    rows["position"][:, 0] += 2 * (np.arange(len(rows)) // window % 2)
    assert 2 * slow.position_matrix[0, 0] / slow.supervision.window > 0.1 * slow.axes[0].limits.velocity
    assert judged(slow, rows)[0] == ""


def test_before_it_is_told_to_stop_nothing_is_judged(rig):
    watch = StoppingWatch(rig)
    watch.begin()  # nothing was seen yet
    rows = rows_of(rig, np.arange(50) * 0.01)
    watch.remember(rows)
    assert watch.judge(rows) == ""


def test_beginning_twice_keeps_the_first_moment(rig):
    rows = rows_of(rig, braking(rig, 1.2, 4.0, reaction=5.0))
    watch = StoppingWatch(rig)
    watch.remember(rows[:BEFORE])
    watch.begin()
    for first in range(BEFORE, BEFORE + 500):
        watch.remember(rows[first : first + 1])
        watch.begin()
        if watch.judge(rows[first : first + 1]):
            return
    raise AssertionError("a stop that is commanded again and again would be begun again and again")
