"""Support points of a drive's own tables: found where the line bends, against a search over all places by another solver."""

from itertools import combinations

import numpy as np
import pytest
from scipy.optimize import lsq_linear

from identify.export.support_points import GRID, SLOWEST, speed_line, turn_line, turn_line_at


@pytest.fixture(scope="module")
def speed():
    time = np.linspace(0.0, 60.0, 4000)
    return 100.0 * np.sin(time) * np.sin(0.11 * time)


def test_a_line_that_a_table_can_hold_is_held_and_an_offset_is_no_friction(speed):
    grid = np.geomspace(SLOWEST * np.abs(speed).max(), np.abs(speed).max(), GRID)
    knots = np.concatenate([[0.0], grid[[5, 30, 55]]])
    ahead, back = np.array([0.0, 2.0, 1.0, 1.5]), np.array([0.0, -1.0, -1.0, -2.5])
    size = np.abs(speed)
    value = np.where(speed >= 0, np.interp(size, knots, ahead), np.interp(size, knots, back))
    line = speed_line(speed, value, 3, mirrored=False, constant=False)
    assert line.speeds == pytest.approx(knots[1:])
    assert line.forward == pytest.approx(ahead[1:], abs=1e-4)
    assert line.backward == pytest.approx(back[1:], abs=1e-4)
    odd = np.sign(speed) * np.interp(size, knots, ahead)
    mirrored = speed_line(speed, odd + 0.7, 3, mirrored=True, constant=False)
    assert mirrored.forward == pytest.approx(ahead[1:], abs=1e-4)
    assert mirrored.constant == 0.0
    kept = speed_line(speed, odd + 0.7, 3, mirrored=True, constant=True)
    assert kept.at(speed) == pytest.approx(odd + 0.7, abs=1e-3)


def test_two_points_are_as_good_as_the_best_of_all_pairs(speed):
    value = np.sign(speed) * (1.0 + 0.8 * np.exp(-np.abs(speed) / 5.0) + 0.01 * np.abs(speed))
    line = speed_line(speed, value, 2, mirrored=True, constant=True)
    grid = np.geomspace(SLOWEST * np.abs(speed).max(), np.abs(speed).max(), GRID)
    size, sign, least = np.abs(speed), np.sign(speed), np.inf
    for pair in combinations(grid[::3], 2):
        knots = np.array([0.0, *pair])
        half = [sign * np.interp(size, knots, row) for row in np.eye(3)[1:]]
        columns = np.column_stack([*half, np.ones(len(speed))])
        least = min(least, 2.0 * lsq_linear(columns, value).cost)
    assert float(((line.at(speed) - value) ** 2).sum()) < 1.01 * least


def test_a_record_that_rests_and_turns_often_does_not_raise_the_first_point(speed):
    slow = np.random.default_rng(3).normal(
        0.0, 0.1, 1500
    )  # at rest the noise of the speed decides on the sign
    every = np.concatenate([speed, slow])

    def friction(of):
        return np.sign(of) * (1.0 + 0.01 * np.abs(of))

    line = speed_line(every, friction(every), 8, mirrored=False, constant=True)
    assert line.forward == pytest.approx(friction(line.speeds), rel=1e-3)
    assert line.backward == pytest.approx(friction(-line.speeds), rel=1e-3)


def test_a_line_has_no_freedom_at_speeds_that_the_record_has_not():
    size = np.concatenate([np.linspace(30.0, 40.0, 500), np.linspace(70.0, 100.0, 500)])
    speed = np.concatenate([size, -size[:500]])
    value = np.sign(speed) * (1.0 + 0.02 * np.abs(speed))
    line = speed_line(speed, value, 6, mirrored=False, constant=False)
    # between its stretches it goes straight on, and beyond them, in either direction, it keeps the last value
    seen = (size >= line.speeds[0]) if line.speeds[0] > 30.0 else np.ones(len(size), bool)
    assert line.at(size[seen]) == pytest.approx(value[:1000][seen], rel=1e-2)
    between = line.at(np.linspace(42.0, 68.0, 9))
    assert between == pytest.approx(1.0 + 0.02 * np.linspace(42.0, 68.0, 9), rel=2e-2)
    assert line.at(np.array([-100.0, -90.0])) == pytest.approx(
        -1.8, rel=0.05
    )  # the next place of the grid is a little beyond


def test_friction_that_would_drive_is_left_out(speed):
    line = speed_line(speed, -np.sign(speed) * 1.0, 4, mirrored=False, constant=False)
    assert line.forward == pytest.approx(0.0, abs=1e-9)
    assert line.backward == pytest.approx(0.0, abs=1e-9)
    with pytest.raises(ValueError, match="no motion"):
        speed_line(np.zeros(10), np.zeros(10), 2, mirrored=True, constant=False)


def test_cogging_over_a_turn_is_held_also_where_the_record_did_not_come():
    angle = np.random.default_rng(4).uniform(-40.0, 40.0, 3000)
    values = turn_line(angle, np.cos(4.0 * angle) + 3.0, 32)
    # a straight line between points 1/8 of a wave apart is off by 1 - cos(pi/8) at most, the best one by half of it
    assert np.abs(turn_line_at(values, angle) - np.cos(4.0 * angle)).max() < 0.07
    part = turn_line(
        angle[np.mod(angle, 2.0 * np.pi) < 5.0], np.cos(angle[np.mod(angle, 2.0 * np.pi) < 5.0]), 32
    )
    assert np.abs(part - np.cos(2.0 * np.pi * np.arange(32) / 32)).max() < 0.5
