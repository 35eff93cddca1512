"""The plan for a rig of which nothing is known but its limits."""

import numpy as np
import pytest

from daq.excitation.plan_limits import violations
from daq.excitation.sinusoid import Sinusoids
from daq.excitation.speed_ladder import Reach
from daq.excitation.standard_plan import (
    FEWEST_REPEATS,
    HARMONICS,
    LONGEST_PERIOD,
    REST,
    approach,
    peak_times,
    random_shape,
    standard_plan,
    sum_of_sinusoids,
)
from daq.excitation.trapezoid import Dwell
from identify.recording.errors import InputError


@pytest.mark.parametrize("seconds", [40.0, 60.0, 200.0])
def test_a_plan_rests_climbs_swings_and_rests_within_its_time_and_all_limits(rig, seconds):
    plan = standard_plan(rig, seconds)
    assert 0.9 * seconds < plan.duration <= seconds
    assert violations(plan, rig) == []
    assert plan.phases[0] == plan.phases[-1] == Dwell(duration=REST)
    (swing,) = [phase for phase in plan.phases if isinstance(phase, Sinusoids)]
    # about two fifths of the time are for sinusoids, and they repeat so that noise shows
    assert swing.duration == pytest.approx(0.4 * (seconds - 2 * REST), rel=0.15)
    assert swing.repeats >= FEWEST_REPEATS
    begin, end = swing.repeated
    assert (end - begin) / swing.repeats <= LONGEST_PERIOD + 1e-9
    assert plan.repeated


def test_a_plan_is_the_same_for_the_same_seed(rig):
    assert standard_plan(rig, 30.0, seed=3) == standard_plan(rig, 30.0, seed=3)
    assert standard_plan(rig, 30.0, seed=3) != standard_plan(rig, 30.0, seed=4)


@pytest.mark.parametrize(
    ("seconds", "words"),
    [
        (1.0, "needs more than 1 s, not 1"),
        (3.0, "the shortest plan lasts"),
        (3601.0, "at most 3600 s, not 3601"),
        (float("inf"), "at most 3600 s, not inf"),
        (float("nan"), "not nan"),
    ],
)
def test_a_time_that_is_too_short_or_too_long_is_refused_with_what_it_takes(rig, seconds, words):
    with pytest.raises(InputError, match=words):
        standard_plan(rig, seconds)


def test_harmonics_have_random_phases_and_fall_off():
    shape = random_shape(3, seed=1)
    assert shape.shape == (2, 3, HARMONICS)
    np.testing.assert_allclose(np.hypot(*shape), np.tile(1 / np.arange(1, HARMONICS + 1), (3, 1)))
    assert np.ptp(np.arctan2(shape[1], shape[0])) > 1.0


@pytest.mark.parametrize("centre", [0.0, 0.5, -0.5])
def test_sinusoids_are_as_large_as_the_first_limit_allows_about_their_centre(rig, centre):
    reach = Reach.of(rig)
    swing = sum_of_sinusoids(reach, 30.0, random_shape(1, 0), np.array([centre]))
    half = 0.5 * (reach.high - reach.low)
    np.testing.assert_allclose(swing.centre, reach.middle + half * centre)
    times = np.linspace(0.0, swing.duration, 60_000)
    position, velocity, acceleration, jerk = swing.evaluate(times, np.array(swing.centre))
    used = [
        np.abs(position - swing.centre).max() / (half * (1 - abs(centre)))[0],
        np.abs(velocity).max() / reach.velocity[0],
        np.abs(acceleration).max() / reach.acceleration[0],
        np.abs(jerk).max() / reach.jerk[0],
    ]
    assert 0.98 < max(used) <= 1.0 + 1e-9


def test_peaks_are_looked_for_in_the_fades_and_in_one_period(rig):
    swing = sum_of_sinusoids(Reach.of(rig), 30.0, random_shape(1, 0), np.zeros(1))
    times = peak_times(swing)
    begin, end = swing.repeated
    assert times[0] == 0.0
    assert times[-1] == swing.duration
    gaps = np.diff(times)
    assert np.sort(gaps)[-2] <= 1.0 / (swing.frequency * HARMONICS * 24) + 1e-9
    assert (times < begin + 1 / swing.frequency).sum() > 24 * HARMONICS
    assert (times >= end).any()


def test_the_way_to_the_start_is_slow_and_none_where_one_is_there(rig):
    assert approach(rig, np.array([0.3]), np.array([0.3])) is None
    way = approach(rig, np.array([0.0]), np.array([1.0]), share=0.1)
    assert way.start == (0.0,)
    position, velocity, acceleration, jerk = way.evaluate(np.linspace(0.0, way.duration, 5000))
    assert position[-1, 0] == pytest.approx(1.0)
    reach = Reach.of(rig)
    for term, limit in ((velocity, reach.velocity), (acceleration, reach.acceleration), (jerk, reach.jerk)):
        assert np.abs(term).max() <= 0.1 * limit[0] * (1 + 1e-9)
    assert np.abs(velocity).max() == pytest.approx(0.1 * reach.velocity[0], rel=1e-3)
