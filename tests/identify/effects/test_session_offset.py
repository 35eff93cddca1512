"""An offset that differs between the sessions: its columns, and that a diagnosis tells it from a gain."""

from __future__ import annotations

import numpy as np
import pytest

import identify
from identify.effects.actuation import DriveGain
from identify.effects.session_offset import SessionOffset
from tests.identify.effects.motions import motion_of
from tests.identify.effects.summaries import summary_of
from tests.plants.single_joint import record, write_experiment


def test_each_later_session_has_a_constant_of_its_own():
    effect = SessionOffset()
    (constants,) = effect.grid(summary_of(sessions=(0, 2, 3)))
    assert [p.name for p in effect.parameters_of(summary_of(), constants)] == [
        "offset_change[2]",
        "offset_change[3]",
    ]
    for session, row in ((0, [0.0, 0.0]), (2, [1.0, 0.0]), (3, [0.0, 1.0])):
        columns = effect.columns(motion_of(session=session), constants)
        np.testing.assert_array_equal(np.unique(columns, axis=0), [row])


def test_it_is_of_the_sessions_and_not_of_the_machine_as_a_gain_that_changed_between_them_is():
    (constants,) = SessionOffset().grid(summary_of(sessions=(0, 1)))
    assert SessionOffset().of_sessions(constants)
    assert DriveGain().of_sessions({"session_1": 0.0})
    assert not DriveGain().of_sessions({})


def test_one_session_alone_has_no_other():
    assert SessionOffset().prevented(summary_of(sessions=(0,))) is not None
    assert SessionOffset().prevented(summary_of(sessions=(0, 1))) is None


@pytest.mark.parametrize("changes", [(0.0, 5.0, 0.0), (0.0, -4.0, 3.0)])
def test_an_offset_that_a_session_has_is_named_and_is_no_gain(tmp_path, changes):
    made = record({}, seed=21, duration=30.0, rate=250.0)
    for columns, change in zip(made.sessions, changes, strict=True):
        columns["v1"] += change / made.joint.drive_gain
    found = identify.diagnose(identify.load_experiment(write_experiment(tmp_path / "bench", made))).joints[0]
    assert [term.effect.name for term in found.missing] == ["session-offset"]
    estimates = found.document().candidates[0].estimates
    assert [each.value for each in estimates] == pytest.approx(changes[1:], abs=0.3)
