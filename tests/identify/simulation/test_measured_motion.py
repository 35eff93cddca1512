"""The motion that a simulation starts from: cut by rows, and thinned so that no impulse of the torque is lost."""

from __future__ import annotations

from dataclasses import fields

import numpy as np
import pytest

from identify.simulation.measured_motion import LARGEST_STEP, MeasuredMotion, Travel
from identify.simulation.unseen_motion import _between

COUNT = 41


def motion(period, **changes):
    """Two joints; every column differs from every other."""
    time = period * np.arange(COUNT)
    two = np.column_stack([time, time**2])
    columns = {
        "time": time,
        "q": two,
        "dq": two + 1,
        "direction": np.sign(two - 0.01),
        "torque": np.sin(40 * two),
        "command": np.cos(30 * two),
        "external": two + 4,
        "temperature": two + 5,
        "ddq": two + 6,
        "resting": two < 0.01,
        "recorded": two + 8,
        "extra": {"qref1": time + 7},
    }
    return MeasuredMotion(period=period, **{**columns, **changes})


NO_COLUMNS = ("period", "extra", "rows_in_one", "travel")
ARRAYS = [each.name for each in fields(MeasuredMotion) if each.name not in NO_COLUMNS]


def test_rows_of_a_motion_are_rows_of_each_of_its_columns():
    whole, part = motion(0.002), slice(5, 17)
    some = whole.rows(part)
    assert len(some) == 12
    assert some.period == 0.002
    for name in ARRAYS:
        np.testing.assert_array_equal(getattr(some, name), getattr(whole, name)[part])
    np.testing.assert_array_equal(some.extra["qref1"], whole.extra["qref1"][part])
    bare = motion(0.002, external=None, temperature=None).rows(part)
    assert bare.external is None
    assert bare.temperature is None


def test_the_span_of_a_joint_that_does_not_move_is_above_zero():
    still = np.column_stack([np.linspace(-0.4, 0.2, COUNT), np.full(COUNT, 3.0)])
    assert motion(0.002, q=still).span == pytest.approx([0.6, 1e-9])


@pytest.mark.parametrize(
    ("period", "stride"), [(LARGEST_STEP, 1), (0.003, 1), (LARGEST_STEP / 2, 2), (0.001, 4), (0.0005, 8)]
)
def test_rows_are_as_far_apart_as_a_simulation_needs_and_no_further(period, stride):
    thin = motion(period).thinned()
    assert thin.period == pytest.approx(stride * period)
    assert thin.period <= LARGEST_STEP * (1 + 1e-9)
    np.testing.assert_array_equal(thin.time, motion(period).time[::stride])
    for name in ("q", "dq", "direction", "temperature", "resting"):
        np.testing.assert_array_equal(getattr(thin, name), getattr(motion(period), name)[::stride])
    np.testing.assert_array_equal(thin.extra["qref1"], motion(period).extra["qref1"][::stride])


def test_the_impulse_of_a_torque_that_is_felt_in_one_row_is_kept():
    for row in range(8, 30):
        torque = np.zeros((COUNT, 2))
        torque[row] = 1.0, -3.0
        thin = motion(0.001, torque=torque, command=2 * torque, external=3 * torque).thinned()
        for values, factor in (
            (thin.torque, 1),
            (thin.command, 2),
            (thin.external, 3),
        ):
            impulse = thin.period * values.sum(axis=0)
            assert impulse == pytest.approx(factor * 0.001 * np.array([1.0, -3.0]), rel=1e-12)


def test_a_torque_that_changes_evenly_is_at_each_row_what_it_was_there_and_stays_so_at_the_ends_where_it_is_constant():
    time = 0.001 * np.arange(COUNT)
    ramp = np.column_stack([3 + 100 * time, np.full(COUNT, 5.0)])
    thin = motion(0.001, torque=ramp, external=None).thinned()
    assert thin.torque[1:-1] == pytest.approx(ramp[::4][1:-1], rel=1e-12)
    assert thin.torque[:, 1] == pytest.approx(np.full(len(thin), 5.0), rel=1e-12)
    assert thin.external is None


@pytest.mark.parametrize(
    ("begin", "end", "rows"), [(0.01, 0.02, (10, 21)), (0.0095, 0.0205, (10, 21)), (-1.0, 9.0, (0, COUNT))]
)
def test_what_lies_between_two_times_has_both_its_ends(begin, end, rows):
    whole = motion(0.001)
    np.testing.assert_array_equal(_between(whole, begin - 1e-9, end + 1e-9).time, whole.time[slice(*rows)])


def test_of_one_row_or_none_there_is_no_motion():
    assert _between(motion(0.001), 0.0095, 0.0105) is None
    assert _between(motion(0.001), 5.0, 6.0) is None


def test_a_recorded_position_is_the_mean_of_the_rows_since_the_row_before():
    thinned = motion(LARGEST_STEP / 4).thinned()
    assert thinned.rows_in_one == 4
    recorded = motion(LARGEST_STEP / 4).recorded
    np.testing.assert_allclose(thinned.recorded[3], recorded[9:13].mean(axis=0), rtol=1e-12)


def test_rows_of_a_motion_keep_their_place_on_the_way_that_led_to_them():
    """Three rows of the record lie before the motion; thinned or cut, it still knows every row of the way."""
    way = np.arange(2.0 * (COUNT + 3)).reshape(-1, 2)
    travel = Travel(way, np.ones(2), 3 + np.arange(COUNT))
    whole = motion(LARGEST_STEP / 4, travel=travel)
    part = whole.thinned().rows(slice(2, 5)).travelled
    np.testing.assert_array_equal(part.q, way)
    assert part.rows.tolist() == [11, 15, 19]
    bare = motion(0.002).travelled
    np.testing.assert_array_equal(bare.q[bare.rows], motion(0.002).q)
