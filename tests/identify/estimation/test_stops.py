"""A sample that mixes in a stop takes no part in the fit, however short the stop is."""

from types import SimpleNamespace

import numpy as np
import pytest

from identify.estimation.record import Record
from identify.estimation.stops import FILTER_REACH, STOP_TIME, recorded_stopping_speed, stopping_speed
from identify.recording.samples import RawSamples
from tests.identify.estimation import simulated_arm

RATE, TURN, SPEED, DECELERATION, REST = 1000.0, 2.0, 0.6, 3.0, 0.015
CUTOFFS = {"position_cutoff": 48.0, "decimation_cutoff": 19.2}


def stop_and_go(rest):
    """Positions (N,) that run at 0.6 rad/s, brake at 3 rad/s² at t = 2 s, rest, and go back as they came."""
    time = np.arange(round(2 * TURN * RATE)) / RATE
    away = np.maximum(np.abs(time - TURN) - 0.5 * rest, 0.0)
    velocity = np.where(time < TURN, 1.0, -1.0) * np.minimum(DECELERATION * away, SPEED)
    return np.cumsum(velocity) / RATE


def left_out(position):
    """Instants of the samples that take no part, s from the turn, and the record that they are of."""
    time = np.arange(len(position)) / RATE
    raw = RawSamples(time, position[:, None], np.zeros((len(position), 1)))
    record = Record.of(simulated_arm.experiment({"s": (raw, "none")}, signals=CUTOFFS))
    samples = record.samples["s"]
    return samples.time[~samples.moving[:, 0]] - TURN, record


def test_a_stop_that_the_position_filter_rounds_off_is_seen_in_the_positions_as_recorded():
    """15 ms at rest between two brakings: the filtered velocity is beyond its rest speed all the time."""
    instants, record = left_out(np.round(stop_and_go(REST), 6))
    assert record.shows_stops.all()
    assert len(instants) >= 3
    period = FILTER_REACH / CUTOFFS["decimation_cutoff"]
    assert np.abs(instants).max() <= period + 0.5 * REST + 1e-3
    assert np.abs(instants).max() >= 0.75 * period


def test_a_reversal_without_a_stop_takes_part():
    instants, _ = left_out(np.round(stop_and_go(0.0), 6))
    assert not len(instants)


@pytest.mark.parametrize(("rest", "stopped"), [(0.3, False), (0.6, False), (1.3, True), (3.0, True)])
@pytest.mark.parametrize("rate", [500.0, 2000.0])
def test_a_joint_has_stopped_where_it_stays_for_the_time_of_a_stop_and_not_where_it_passes_through_rest(
    rest, stopped, rate
):
    time = np.arange(round(0.6 * rate)) / rate
    dq = np.where(np.abs(time - 0.3) < 0.5 * rest * STOP_TIME, 0.01, 1.0)[:, None]
    block = SimpleNamespace(
        dq=dq,
        position=np.cumsum(dq, axis=0) / rate,
        shared=None,
        cutoff=20.0,
        sampling_period=1 / rate,
        at_decimated=lambda values: values,
    )
    for slowest in (stopping_speed(block).min(), recorded_stopping_speed(block).min()):
        assert (slowest < 0.05) == stopped


@pytest.mark.parametrize("step", [1e-4, 1e-3])
def test_positions_too_coarse_to_tell_a_stop_from_slow_motion_are_not_asked(step):
    _, record = left_out(np.round(stop_and_go(REST) / step) * step)
    assert not record.shows_stops.any()


def test_rounding_that_is_coarser_in_places_counts_as_coarse():
    """A record of so many digits: positions before the turn are rounded more coarsely than those at it."""
    position = stop_and_go(REST)
    position = np.where(position > 0.5, np.round(position, 6), np.round(position, 3))
    _, record = left_out(position)
    assert not record.shows_stops.any()
    assert record.position_resolution[0] < 2e-6
