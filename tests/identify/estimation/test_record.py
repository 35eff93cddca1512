"""What a record says of its joints, against the samples it was written from."""

from __future__ import annotations

from types import SimpleNamespace

import numpy as np
import pytest

import identify
from identify.estimation.record import Record
from tests.identify.estimation.shared_motor_arm import SharedMotorArm, experiment


@pytest.fixture(scope="module")
def record(three_sessions) -> Record:
    return Record.of(identify.load_experiment(three_sessions))


def test_the_summary_of_a_joint_is_that_of_its_identification_sessions(record, three_sessions):
    (summary,) = record.summaries
    tables = [
        np.loadtxt(three_sessions / f"session-{index:02d}.csv", delimiter=",", skiprows=1)
        for index in range(3)
    ]
    q = np.concatenate([table[:, 1] for table in tables])
    reach = np.ptp(q)
    # The filters' edges are trimmed, which the extremes of a motion that repeats hardly notice.
    np.testing.assert_allclose(summary.position_range, (q.min(), q.max()), atol=0.02 * reach)
    expected = np.quantile(q, np.linspace(0, 1, 17))
    np.testing.assert_allclose(summary.position_quantiles, expected, atol=0.05 * reach)
    assert summary.position_quantiles[0] == summary.position_range[0]
    assert summary.position_quantiles[-1] == summary.position_range[1]
    speed = np.abs(
        np.concatenate(
            [(table[10:, 1] - table[:-10, 1]) / (table[10:, 0] - table[:-10, 0]) for table in tables]
        )
    )
    assert summary.maximum_speed == pytest.approx(np.quantile(speed, 0.999), rel=0.05)
    samples = [record.samples[entry.file] for entry in record.experiment.sessions]
    moving = np.concatenate([np.abs(part.dq[part.moving[:, 0], 0]) for part in samples])
    assert summary.speed_quantiles[5] == pytest.approx(np.median(moving))
    assert np.all(np.diff(summary.speed_quantiles) > 0)
    assert (summary.name, summary.revolute, summary.motor_ratio) == ("elbow", True, 1.0)
    assert summary.payload_masses == (0.0, 2.0, 4.0)
    assert summary.payload_of_session == (0, 1, 2)
    assert summary.loaded_sessions == 2
    assert summary.session_durations == pytest.approx((16.0, 16.0, 16.0), abs=0.01)
    assert summary.period == pytest.approx(1 / 250)
    assert not summary.has_temperature
    assert not summary.has_external_force


def test_sessions_begin_where_those_before_them_ended(record):
    durations = [record.facts(entry).duration for entry in record.experiment.sessions]
    begun = [record.started(entry) for entry in record.experiment.sessions]
    np.testing.assert_allclose(begun, np.concatenate([[0.0], np.cumsum(durations)[:-1]]))


def test_a_joint_may_be_at_rest_below_a_part_of_its_top_speed_or_what_the_encoder_resolves(record):
    assert record.rest_speed == pytest.approx(
        np.maximum(2e-3 * record.top_speed, 3 * record.speed_resolution)
    )
    step = record.position_resolution[0]
    cutoff, period = record.settings.position_cutoff[0], 1 / 250
    white = step / np.sqrt(12) * 2 * np.pi * cutoff * np.sqrt(2 * cutoff * period / 3)
    assert record.speed_resolution[0] == pytest.approx(white)


def test_a_motor_that_joints_share_may_be_at_rest_below_a_part_of_its_own_top_speed():
    """The second motor turns with both joints, r of the first and its own."""
    arm = SharedMotorArm()
    record = Record.of(experiment(arm, {"none": 0.0}, 10.0))
    speeds = record.samples[record.entries()[0].file].dq @ np.array([arm.r, 1.0])
    expected = max(
        2e-3 * np.quantile(np.abs(speeds), 0.999),
        3 * np.hypot(arm.r * record.speed_resolution[0], record.speed_resolution[1]),
    )
    assert record._rest_speed_of_motors == pytest.approx([expected])


def test_the_resolution_of_a_position_is_its_smallest_step_in_any_session_and_none_where_it_never_changed():
    steps = {"a": [1e-3, np.inf, np.inf], "b": [5e-4, np.inf, 2e-3]}
    stands_in = SimpleNamespace(
        experiment=SimpleNamespace(sessions=tuple(steps)),
        facts=lambda entry: SimpleNamespace(position_step=np.array(steps[entry])),
    )
    assert Record.position_resolution.func(stands_in).tolist() == [5e-4, 0.0, 2e-3]
