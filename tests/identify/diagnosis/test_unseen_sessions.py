"""When a model that suits the sessions of its fit fails on others: twice the error, of the torque and absolute."""

from __future__ import annotations

import numpy as np
import pytest

from identify.diagnosis.unseen_sessions import fails_on_unseen
from identify.estimation.prediction import Prediction


def session(error: float, torque: float = 10.0, moving: bool = True) -> Prediction:
    """A session whose residual is `error` at every sample, of either sign."""
    still = np.zeros(50)
    sign = np.where(np.arange(50) % 2, 1.0, -1.0)
    measured = np.full(50, torque)
    return Prediction(
        "s.csv", "j1", still, still, still, still, still, measured, measured - error * sign,
        np.full(50, moving), None,
    )  # fmt: skip


@pytest.mark.parametrize(
    ("unseen", "fails"),
    [
        ([session(1.98)], False),
        ([session(2.02)], True),
        # twice the error of twice the torque is the same part of it
        ([session(2.02, torque=20.2)], False),
        # a small part of a small torque is no greater error
        ([session(0.5, torque=2.0)], False),
        ([], False),
        ([session(9.0, moving=False)], False),
        # over both sessions: the root of the mean square, (9 + 0.25) / 2, is beyond 2
        ([session(3.0), session(0.5)], True),
    ],
)
def test_beyond_twice_the_known_error_in_both_ways_it_fails(unseen, fails):
    assert fails_on_unseen([session(1.0)], unseen) is fails
