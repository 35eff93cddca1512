"""When a fit is doubted: error on unseen motion, and shares that are huge and cancel each other."""

from __future__ import annotations

from types import SimpleNamespace

import numpy as np
import pytest

from identify.estimation.doubts import Doubt, cancels, in_words, predicts_worse


@pytest.mark.parametrize(("unseen", "worse"), [(None, False), (0.2, False), (0.2001, True)])
def test_more_than_twice_the_error_of_the_fit_is_much_worse(unseen, worse):
    fitted = SimpleNamespace(fit=SimpleNamespace(condition_number=123.4))
    words = predicts_worse(fitted, 0.1, unseen)  # type: ignore[arg-type]
    assert (words is not None) is worse
    if words:
        assert "(0.2 of the torque) than its own (0.1)" in words
        assert "condition number 123" in words


def fitted(shares: list[tuple[float, float]], torque: float = 1.0):
    """A fit whose parameters, all of one, have these shares of the torque in two directions; columns 3, 5, 7."""
    count = len(shares)
    fit = SimpleNamespace(
        r=np.array(shares).T,
        chi=np.ones(10),
        fitted=np.array([3, 5, 7][:count]),
        weights=np.array([2.0]),
        norm=np.array([torque / 2.0]),
    )
    return SimpleNamespace(fit=fit)


def test_shares_that_are_huge_and_opposite_cancel():
    assert cancels(fitted([(11.0, 0.0), (-11.0, 5.4)])) == [(3, 5)]
    # what is left of both must be less than half of the smaller
    assert cancels(fitted([(11.0, 0.0), (-11.0, 5.6)])) == []
    # ten times the torque is not huge yet
    assert cancels(fitted([(10.0, 0.0), (-11.0, 0.0)])) == []
    assert cancels(fitted([(11.0, 0.0), (11.0, 0.0)])) == []
    assert cancels(fitted([(11.0, 0.0), (0.0, 30.0), (-11.5, 0.0)])) == [(3, 7)]
    assert cancels(fitted([(11.0, 0.0), (-11.0, 0.0)], torque=2.0)) == []


def test_a_fit_of_nothing_or_of_other_parameters_has_no_pairs():
    nothing = fitted([(11.0, 0.0), (-11.0, 0.0)])
    nothing.fit.fitted = np.array([3])
    assert cancels(nothing) == []
    nothing.fit.r, nothing.fit.fitted = np.zeros((2, 0)), np.array([], int)
    assert cancels(nothing) == []


def held(name, figure):
    return Doubt(
        name, "is held at 0: least squares would find", "are held at 0: least squares would find", figure
    )


def test_parameters_of_which_the_same_is_said_share_a_sentence_and_each_keeps_its_figure():
    negative = Doubt("Ia5", "is negative", "are negative")
    pair = Doubt("M1 and M2", "cancel each other", "cancel each other, each pair")
    assert in_words([held("FV1", "-1"), negative, held("FC3", "-2.5"), pair, pair]) == [
        "FV1, FC3 are held at 0: least squares would find -1, -2.5",
        "Ia5 is negative",
        "M1 and M2 cancel each other",
    ]
    assert in_words([held("FV1", "-1")]) == ["FV1 is held at 0: least squares would find -1"]
    assert in_words([negative, Doubt("Ia6", "is negative", "are negative")]) == ["Ia5, Ia6 are negative"]
