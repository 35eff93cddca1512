"""The relative error of predictions, against numbers worked out by hand."""

import math

import numpy as np
import pytest

from identify.estimation.prediction import Prediction, mean_error, relative_error


def prediction(measured, predicted, moving) -> Prediction:
    nothing = np.zeros(len(measured))
    return Prediction(
        file="session-00.csv",
        joint="j1",
        time=nothing,
        position=nothing,
        velocity=nothing,
        acceleration=nothing,
        load=nothing,
        measured=np.array(measured, float),
        predicted=np.array(predicted, float),
        moving=np.array(moving),
        temperature=None,
    )


FIRST = prediction([3.0, 4.0, 100.0], [3.0, 1.0, 0.0], [True, True, False])
SECOND = prediction([12.0], [8.0], [True])


def test_the_residual_is_measured_less_predicted_and_rest_does_not_count():
    np.testing.assert_array_equal(FIRST.residual, [0.0, 3.0, 100.0])
    assert FIRST.relative_error == pytest.approx(3.0 / 5.0, rel=1e-15)


def test_several_sessions_are_one_long_one_and_not_the_mean_of_their_errors():
    assert mean_error([FIRST, SECOND]) == pytest.approx(5.0 / 13.0, rel=1e-15)


def test_where_nothing_was_measured_there_is_no_relative_error():
    assert math.isnan(relative_error(np.ones(2), np.zeros(2)))
    assert math.isnan(prediction([1.0], [0.0], [False]).relative_error)
    assert relative_error(np.zeros(2), np.ones(2)) == 0.0
