"""What an identification says of itself: errors on each kind of session by its own predictions, and what it refuses."""

from __future__ import annotations

import numpy as np
import pytest

import identify
from identify.recording.errors import InputError
from tests.identify.estimation.simulated_arm import Arm, Motion, experiment, record

NOISE = {"a": 2.0, "b": 6.0, "c": 12.0}
"""N m: the session of the fit, the one that is left out of it, and the one for validation"""


@pytest.fixture(scope="module")
def result():
    made = {
        name: (
            record(
                Motion(),
                Arm(),
                np.random.default_rng(ord(name)),
                duration=10.0,
                torque_noise=noise,
                payload=mass,
            ),
            payload,
        )
        for (name, noise), payload, mass in zip(
            NOISE.items(), ("none", "disc", "none"), (0.0, 3.0, 0.0), strict=True
        )
    }
    given = experiment(made, payloads=[("disc", 3.0)], roles={"c": "validation"})
    return identify.identify(given, "usual", payloads=["none"])


def error_of(result, file):
    one = result.prediction(file, "j3")
    return np.linalg.norm(one.residual[one.moving]) / np.linalg.norm(one.measured[one.moving])


def test_the_errors_are_those_of_the_predictions_of_each_kind_of_session(result):
    assert [result.role_of(entry) for entry in result.experiment.sessions] == [
        "identification",
        "left out",
        "validation",
    ]
    assert result.relative_error == pytest.approx(error_of(result, "a"), rel=1e-6)
    assert result.relative_error_left_out == pytest.approx(error_of(result, "b"), rel=1e-6)
    assert result.relative_error_validation == pytest.approx(error_of(result, "c"), rel=1e-6)
    assert result.relative_error < result.relative_error_left_out < result.relative_error_validation


def test_without_such_sessions_there_is_no_such_error():
    raw = record(Motion(), Arm(), np.random.default_rng(1), duration=10.0, torque_noise=1.0)
    alone = identify.identify(experiment({"a": (raw, "none")}), "usual")
    assert alone.relative_error_left_out is None
    assert alone.relative_error_validation is None
    assert alone.structured_parameters == ()


@pytest.mark.parametrize(("file", "joint"), [("d", "j3"), ("a", "j4")])
def test_a_session_or_joint_that_there_is_not_is_refused_with_those_that_there_are(result, file, joint):
    with pytest.raises(
        InputError, match=f"session '{file}', joint '{joint}': sessions are a, b, c; joints are j3"
    ):
        result.prediction(file, joint)
