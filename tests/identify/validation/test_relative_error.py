"""Relative errors, against norms taken by hand."""

from pathlib import Path

import numpy as np
import pytest

from identify.estimation.prediction import Prediction
from identify.recording import SessionEntry
from identify.recording.experiment_file import Payload
from identify.validation.relative_error import SPEED_RANGES, by_payload, by_speed, ratio, squares_in


def course(joint, velocity, measured, residual, moving=None):
    velocity, measured, residual = (np.array(values, float) for values in (velocity, measured, residual))
    nothing = np.zeros(len(velocity))
    moving = np.ones(len(velocity), bool) if moving is None else np.array(moving)
    return Prediction(
        "s.csv",
        joint,
        nothing,
        nothing,
        velocity,
        nothing,
        nothing,
        measured,
        measured - residual,
        moving,
        None,
    )


def test_the_ratio_is_that_of_the_norms_and_none_where_nothing_was_measured():
    assert ratio(9.0, 36.0) == pytest.approx(0.5)
    assert ratio(0.0, 4.0) == 0.0
    assert ratio(1.0, 0.0) is None


def test_only_moving_samples_within_the_range_count():
    slow = next(speed for speed in SPEED_RANGES if speed.name == "low")
    made = course(
        "j1",
        [0.1, -0.2, 0.21, 2.0, 0.0],
        [3.0, 4.0, 100.0, 100.0, 100.0],
        [1.0, 2.0, 9.0, 9.0, 9.0],
        [True, True, True, True, False],
    )
    # the top speed is 2, so low ends at 0.2, either way of motion
    np.testing.assert_allclose(squares_in(slow, made, 2.0), [1.0 + 4.0, 9.0 + 16.0, 2.0])


def test_errors_by_speed_are_pooled_over_joints_and_kept_apart_by_role():
    fit = [course("j1", [1.0, 0.05], [4.0, 3.0], [2.0, 1.5]), course("j2", [1.0], [5.0], [0.5])]
    check = [course("j1", [1.0], [10.0], [1.0])]
    rows = {
        row.range: row
        for row in by_speed({"identification": fit, "validation": check}, {"j1": 1.0, "j2": 1.0})
    }
    whole = rows["all"]
    assert whole.samples == 3
    assert whole.relative_error == pytest.approx(np.sqrt((4 + 2.25 + 0.25) / (16 + 9 + 25)))
    assert whole.relative_error_validation == pytest.approx(0.1)
    low = {joint.joint: joint for joint in rows["low"].joints}
    assert low["j1"].relative_error == pytest.approx(0.5)
    assert low["j2"].relative_error is None
    high = {joint.joint: joint for joint in rows["high"].joints}
    assert (high["j1"].samples, high["j1"].relative_error) == (1, pytest.approx(0.5))
    assert high["j2"].relative_error_validation is None


def test_errors_by_payload_add_the_sessions_of_a_role_and_tell_no_mass_that_is_not_known():
    def entry(payload, mass):
        return SessionEntry("s.csv", Path("s.csv"), Payload(name=payload, mass=mass), "identification")

    sessions = [
        (entry("disk", 3.0), "identification", np.array([1.0, 100.0])),
        (entry("none", 0.0), "identification", np.array([4.0, 16.0])),
        (entry("disk", 3.0), "identification", np.array([3.0, 300.0])),
        (entry("disk", 3.0), "validation", np.array([9.0, 81.0])),
    ]
    found = {(row.payload, row.role): row for row in by_payload(sessions)}
    assert found["disk", "identification"].relative_error == pytest.approx(0.1)
    assert found["disk", "validation"].relative_error == pytest.approx(1 / 3)
    assert found["none", "identification"].relative_error == pytest.approx(0.5)
    assert [row.mass for row in found.values()] == [3.0, 0.0, 3.0]
    assert {row.payload: row.mass for row in by_payload(sessions, ["disk"])} == {"disk": None, "none": 0.0}
