"""The servo's loops against closed forms: a filter's step, a PI controller's output, its limit and wind-up."""

import math

import pytest

from drivers.simulated.servo import Servo
from drivers.simulated.settings import ServoSettings, SimulatedAxis

PERIOD = 1e-3


def axis(**gains) -> SimulatedAxis:
    servo = ServoSettings(
        **({"position_gain": 40.0, "velocity_gain": 2.0, "velocity_integral": 20.0} | gains)
    )
    return SimulatedAxis(node=1, counts_per_turn=10_000, max_speed=100.0, servo=servo)


PER_RADIAN = 10_000 / (2 * math.pi)


def test_the_velocity_is_the_encoder_s_difference_behind_a_low_pass():
    servo = Servo(axis(velocity_filter=0.004))
    for sample in range(5):
        servo.observe(7 * sample, PERIOD)
    # four steps after the first position, of a first-order filter
    assert servo.velocity == pytest.approx(7 / PERIOD * (1 - math.exp(-4 * PERIOD / 0.004)))


def test_without_a_filter_it_is_the_difference_itself():
    servo = Servo(axis(velocity_filter=0.0))
    servo.observe(100, PERIOD)
    assert servo.velocity == 0.0  # one position is no velocity
    servo.observe(103, PERIOD)
    assert servo.velocity == pytest.approx(3000.0)
    servo.shift(50)
    servo.observe(156, PERIOD)
    assert servo.velocity == pytest.approx(3000.0)


def test_the_current_is_proportional_and_integral():
    servo = Servo(axis())
    error = 2.0 * PER_RADIAN
    currents = [servo.follow_velocity(error, 1e9, PERIOD) for _ in range(3)]
    # gains are stated for a radian: 2 A s/rad and 20 A/rad
    expected = [2.0 * 2.0 + 20.0 * 2.0 * PERIOD * count for count in (1, 2, 3)]
    assert currents == pytest.approx(expected)
    assert not servo.limited


def test_position_becomes_a_velocity_with_the_feed_forward_added():
    position, velocity = Servo(axis()), Servo(axis())
    by_position = position.follow_position(120.0, 55.0, 100, 1e9, PERIOD)
    assert by_position == pytest.approx(velocity.follow_velocity(40.0 * 20.0 + 55.0, 1e9, PERIOD))


@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_the_reference_is_no_faster_than_the_axis(sign):
    fast, top = Servo(axis()), Servo(axis())
    expected = top.follow_velocity(sign * 100.0 * PER_RADIAN, 1e9, PERIOD)
    assert fast.follow_velocity(sign * 1000.0 * PER_RADIAN, 1e9, PERIOD) == pytest.approx(expected)


@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_at_the_limit_the_integrator_waits_unless_the_error_lets_it_come_back(sign):
    servo = Servo(axis())
    for _ in range(100):
        assert servo.follow_velocity(sign * 5.0 * PER_RADIAN, 3.0, PERIOD) == sign * 3.0
        assert servo.limited
    # nothing was wound up: the first current within the limit is that of a fresh controller
    fresh = Servo(axis()).follow_velocity(sign * PER_RADIAN, 3.0, PERIOD)
    assert servo.follow_velocity(sign * PER_RADIAN, 3.0, PERIOD) == pytest.approx(fresh)
    assert not servo.limited
    servo.reset(sign * 50.0)
    for _ in range(3):
        assert servo.follow_velocity(-sign * PER_RADIAN, 3.0, PERIOD) == sign * 3.0
    # 50 A less three steps of 0.02 A: it came down although the limit was in force
    assert servo.follow_velocity(0.0, 1e9, PERIOD) == pytest.approx(sign * (50.0 - 3 * 20.0 * PERIOD))


def test_another_zero_or_direction_begins_anew_at_the_velocity_that_goes_on():
    servo = Servo(axis())
    servo.observe(0, PERIOD)
    servo.follow_velocity(PER_RADIAN, 1e9, PERIOD)
    servo.look_anew(-250.0)
    servo.observe(123_456, PERIOD)
    assert servo.velocity == -250.0
    assert servo.follow_velocity(-250.0, 1e9, PERIOD) == 0.0
