"""What a model gives over speed and over a turn, in intervals: median and spread, each direction for itself."""

import numpy as np

from api.drive_table_curves import curve_over_speed, curve_over_turn
from identify.export.support_points import SLOWEST


def test_medians_follow_the_friction_of_either_direction_and_the_spread_is_that_of_the_load():
    random = np.random.default_rng(2)
    speed = random.uniform(-100.0, 100.0, 20_000)
    load = random.uniform(-0.2, 0.2, 20_000)
    rows = np.array(curve_over_speed(speed, np.sign(speed) * (1.0 + 0.01 * np.abs(speed)) + load))
    assert (np.diff(rows[:, 0]) > 0.0).all()
    wanted = np.sign(rows[:, 0]) * (1.0 + 0.01 * np.abs(rows[:, 0]))
    fast = np.abs(rows[:, 0]) > 5.0
    np.testing.assert_allclose(rows[fast, 1], wanted[fast], atol=0.05)
    np.testing.assert_allclose((rows[fast, 3] - rows[fast, 2]).mean(), 0.8 * 0.4, rtol=0.1)


def test_slower_samples_than_any_support_point_and_speeds_that_were_not_driven_have_no_interval():
    speed = np.concatenate([np.full(50, 0.5 * SLOWEST * 100.0), np.linspace(60.0, 100.0, 200)])
    rows = np.array(curve_over_speed(speed, np.ones(250)))
    assert rows[:, 0].min() > 58.0
    assert curve_over_speed(np.zeros(5), np.ones(5)) == ()


def test_a_turn_is_counted_from_the_encoders_zero_in_either_direction():
    angle = np.linspace(-20.0, 20.0, 9000)
    rows = np.array(curve_over_turn(angle, np.cos(3.0 * angle)))
    assert 0.0 < rows[0, 0] < rows[-1, 0] < 1.0
    np.testing.assert_allclose(rows[:, 1], np.cos(6.0 * np.pi * rows[:, 0]), atol=0.05)
