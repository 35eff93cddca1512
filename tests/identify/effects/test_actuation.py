"""Between command and torque: columns against their formulas."""

import numpy as np
import pytest

from identify.effects.actuation import Delay, DriveGain, GainSaturation
from tests.identify.effects.motions import PERIOD, motion_of
from tests.identify.effects.summaries import LARGEST_LOAD, summary_of

MOTION = motion_of()


@pytest.mark.parametrize(("threshold", "power"), [(0.0, 3.0), (20.0, 2.0)])
def test_a_gain_that_falls_costs_current_beyond_a_threshold(threshold, power):
    column = GainSaturation().columns(MOTION, {"threshold": threshold, "power": power})[:, 0]
    torque = MOTION.model_torque
    beyond = np.abs(torque) > threshold
    np.testing.assert_array_equal(column[~beyond], 0.0)
    np.testing.assert_allclose(np.abs(column[beyond]), (np.abs(torque[beyond]) - threshold) ** power)
    assert (column * torque >= 0).all()


def test_thresholds_are_shares_of_the_largest_load_either_way():
    for load_range in ((-LARGEST_LOAD, 1.0), (-1.0, LARGEST_LOAD)):
        tried = GainSaturation().grid(summary_of(load_range=load_range))
        assert tried[0] == {"threshold": 0.0, "power": 3.0}
        assert [each["threshold"] for each in tried[1:]] == [0.0, 0.25 * 80.0, 0.5 * 80.0, 0.7 * 80.0]
        assert {each["power"] for each in tried[1:]} == {2.0}


def test_one_gain_is_a_column_of_the_known_load_and_reported_as_a_ratio():
    effect = DriveGain()
    np.testing.assert_array_equal(effect.columns(MOTION, {})[:, 0], MOTION.known_load)
    assert effect.reported_offset({}) == 1.0
    assert effect.replaces_payload_ratio({})


def test_a_gain_that_changed_between_sessions_has_a_column_for_each_later_session():
    effect = DriveGain()
    one, changed = effect.grid(summary_of(sessions=(0, 1, 4)))
    assert one == {}
    assert changed == {"session_1": 0.0, "session_4": 1.0}
    names = [parameter.name for parameter in effect.parameters_of(summary_of(), changed)]
    assert names == ["gain_change[1]", "gain_change[4]"]
    for session, column in ((0, None), (1, 0), (4, 1)):
        columns = effect.columns(motion_of(session=session), changed)
        assert columns.shape == (len(MOTION.q), 2)
        for place in (0, 1):
            expected = MOTION.model_torque if place == column else 0.0 * MOTION.q
            np.testing.assert_array_equal(columns[:, place], expected)
    assert effect.reported_offset(changed) == 0.0
    assert not effect.replaces_payload_ratio(changed)


def test_without_a_known_load_or_a_second_session_no_gain_is_tried():
    effect = DriveGain()
    assert effect.grid(summary_of(loaded_sessions=0, sessions=(0,))) == []
    assert effect.grid(summary_of(loaded_sessions=0, has_external_force=True, sessions=(0,))) == [{}]


def test_a_delay_is_the_rate_of_the_torque_with_a_minus():
    smooth = motion_of(model_torque=30.0 * np.sin(20.0 * MOTION.time))
    column = Delay().columns(smooth, {})[:, 0]
    np.testing.assert_allclose(column[1:-1], -600.0 * np.cos(20.0 * MOTION.time[1:-1]), atol=0.1)
    assert Delay().command_lead(np.array([0.002])) == 0.002


@pytest.mark.parametrize(
    ("periods", "margin", "held"),
    [
        (0.5, 0.0, True),
        (-0.5, 0.01, True),
        (0.36, 0.01, False),  # near, but certainly another time
        (0.36, 0.15, True),  # as near, and nothing tells it from half a period
        (-0.66, 0.15, False),
        (0.0, 0.1, False),
    ],
)
def test_half_a_period_is_what_a_held_command_makes(periods, margin, held):
    said = Delay().made_by_recording(np.array([periods * PERIOD]), np.array([margin * PERIOD]), PERIOD)
    assert (said is not None) == held
