"""Stamps that repeat or go back, and gaps: left out or bridged, and said with how many."""

import numpy as np
import pytest

from identify.recording.errors import InputError
from identify.recording.foreign.repair import bridged, refuse_coarse_clock, repaired_stamps
from identify.recording.foreign.table import Clock


def test_stamps_that_increase_are_left_alone():
    time = np.array([0.0, 0.1, 0.3])
    new, rows, said = repaired_stamps(time, "drop")
    np.testing.assert_array_equal(new, time)
    assert (rows.tolist(), said) == ([0, 1, 2], [])


def test_dropping_leaves_out_what_does_not_come_after_all_before():
    new, rows, said = repaired_stamps(np.array([0.0, 1.0, 1.0, 3.0, 2.0, 2.5, 4.0]), "drop")
    assert new.tolist() == [0.0, 1.0, 3.0, 4.0]
    assert rows.tolist() == [0, 1, 3, 6]
    assert said == ["1 stamp repeats and 1 step back in time: 3 of 7 samples left out"]


def test_bridging_spaces_stamps_of_a_coarse_clock_evenly():
    clock = np.repeat(np.arange(5.0), 4)
    new, rows, said = repaired_stamps(clock, "bridge")
    np.testing.assert_allclose(new, np.arange(20) / 4)
    assert len(rows) == 20
    assert said == ["15 stamps repeat: spaced evenly"]


def test_bridging_moves_what_follows_a_step_back_on_by_one_typical_step():
    time = np.concatenate([np.arange(5) * 0.1, 0.05 + np.arange(5) * 0.1])
    new, _, said = repaired_stamps(time, "bridge")
    np.testing.assert_allclose(np.diff(new), 0.1)
    assert said == ["1 step back in time: later stamps moved on by 0.45 s in all"]


def clock_of(time) -> Clock:
    return Clock(seconds=time, begin=None, of_day=False, said="")


@pytest.mark.parametrize("repair", [None, "drop"])
def test_a_clock_most_of_whose_stamps_repeat_is_refused_with_the_digits_that_lack(repair):
    time = np.repeat(np.arange(3.0), 100)
    with pytest.raises(InputError, match="300 samples have 3 different times: digits were lost"):
        refuse_coarse_clock(time, clock_of(time), "a.csv: column 't'", repair)


def test_half_of_the_stamps_may_repeat_and_a_repair_may_have_more():
    just = np.concatenate([np.arange(60.0), np.arange(59.0)])
    refuse_coarse_clock(just, clock_of(just), "t", None)
    coarse = np.repeat(np.arange(60.0), 4)
    with pytest.raises(InputError, match="space them evenly by --repair bridge"):
        refuse_coarse_clock(coarse, clock_of(coarse), "t", None)
    refuse_coarse_clock(coarse, clock_of(coarse), "t", "bridge")


def test_short_gaps_are_bridged_by_straight_lines_and_long_ones_are_not_used():
    time = 0.01 * np.arange(100)
    line = 3.0 * time + 1.0
    values = np.column_stack([line, line])
    values[10, 0] = values[60:90, 1] = values[0, 1] = np.nan
    filled, usable, count = bridged(time, values)
    assert filled[10, 0] == pytest.approx(line[10])
    assert count == 1
    assert np.flatnonzero(~usable).tolist() == [0, *range(60, 90)]


def test_a_column_without_a_value_leaves_nothing_to_use():
    values = np.column_stack([np.zeros(10), np.full(10, np.nan)])
    _, usable, count = bridged(np.arange(10.0), values)
    assert not usable.any()
    assert count == 0
