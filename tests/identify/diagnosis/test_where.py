"""Where a model fails, of residuals that fail in a known place."""

from __future__ import annotations

import numpy as np
import pytest

from identify.diagnosis.where import where_it_fails
from identify.estimation.prediction import Prediction

COUNT = 1200


def prediction(residual, file="s.csv", moving=None, temperature=None, position=None):
    """A joint whose position runs evenly from 0 to 1, and everything else with it, at speeds that only rise."""
    time = np.arange(COUNT) / 100
    ramp = np.linspace(0, 1, COUNT)
    return Prediction(
        file=file,
        joint="j1",
        time=time,
        position=ramp if position is None else position,
        velocity=np.linspace(1, 2, COUNT),
        acceleration=np.linspace(-3, 3, COUNT),
        load=np.zeros(COUNT),
        measured=residual,
        predicted=np.zeros(COUNT),
        moving=np.ones(COUNT, bool) if moving is None else moving,
        temperature=temperature,
    )


def at(rows, variable):
    return next(row for row in rows if row.variable == variable)


def test_all_error_between_a_third_and_a_half_of_the_way():
    """Four of twelve bins of equal numbers of samples would hold a third of an even error; two hold all."""
    residual = np.zeros(COUNT)
    residual[400:600] = [1.0, -1.0] * 100
    rows = where_it_fails([prediction(residual)])
    q = at(rows, "q")
    assert q.from_ == pytest.approx(1 / 3, abs=1e-3)
    assert q.to == pytest.approx(1 / 2, abs=1e-3)
    assert q.share_of_error == pytest.approx(1.0)
    assert q.share_of_samples == pytest.approx(1 / 6, abs=2e-3)
    assert q.excess == pytest.approx(5 / 6, abs=2e-3)
    assert [row.excess for row in rows] == sorted((row.excess for row in rows), reverse=True)
    # the load never changes, and there is one session only: nothing to be said of either
    assert {row.variable for row in rows} == {"q", "dq", "ddq", "time", "travel since reversal"}
    assert at(rows, "ddq").from_ == pytest.approx(-1.0, abs=5e-3)
    assert at(rows, "time").to == pytest.approx(6.0, abs=0.02)


def test_error_to_the_last_sample_ends_the_range_at_the_greatest_value():
    residual = np.zeros(COUNT)
    residual[1100:] = 2.0
    dq = at(where_it_fails([prediction(residual)]), "dq")
    assert dq.to == 2.0
    assert dq.share_of_error == pytest.approx(1.0)
    assert dq.from_ == pytest.approx(1 + 11 / 12, abs=2e-3)


def test_two_places_are_one_range_where_what_is_between_costs_less_than_the_second_brings():
    """Bins 2 and 4 with 3 of 7 of the error each, 1 of 7 in bin 9: bin 3 costs a twelfth."""
    residual = np.zeros(COUNT)
    residual[200:300] = residual[400:500] = np.sqrt(3.0)
    residual[900:1000] = 1.0
    q = at(where_it_fails([prediction(residual)]), "q")
    assert (q.from_, q.to) == (pytest.approx(1 / 6, abs=1e-3), pytest.approx(5 / 12, abs=1e-3))
    assert q.share_of_error == pytest.approx(6 / 7)
    assert q.share_of_samples == pytest.approx(3 / 12, abs=2e-3)


def test_rest_is_left_out_and_no_error_is_nowhere():
    residual = np.zeros(COUNT)
    residual[:100] = 1.0
    assert where_it_fails([prediction(residual, moving=np.arange(COUNT) >= 100)]) == ()
    assert where_it_fails([prediction(np.zeros(COUNT))]) == ()


def test_an_even_error_exceeds_its_share_nowhere():
    rows = where_it_fails([prediction(np.ones(COUNT))])
    assert all(row.excess == pytest.approx(0.0, abs=1e-12) for row in rows)


def test_a_variable_of_few_values_has_no_range():
    steps = np.repeat([0.0, 1.0, 2.0], [450, 400, 350])
    rows = where_it_fails([prediction(np.linspace(0, 1, COUNT), position=steps)])
    assert "q" not in {row.variable for row in rows}
    four = np.repeat([0.0, 1.0, 2.0, 3.0], [250, 300, 400, 250])
    rows = where_it_fails([prediction(np.linspace(0, 1, COUNT), position=four)])
    q = at(rows, "q")
    assert (q.from_, q.to) == (2.0, 3.0)


def test_the_session_whose_share_of_the_error_is_largest_for_its_samples_is_named():
    """Errors 1 : 4, samples 1 : 2, so shares 1/5 and 4/5 beside 1/3 and 2/3."""
    short = prediction(np.ones(COUNT), "short.csv", np.arange(COUNT) < COUNT // 2)
    long = prediction(np.full(COUNT, np.sqrt(2.0)), "long.csv")
    session = at(where_it_fails([short, long]), "session")
    assert (session.from_, session.to, session.label) == (1, 1, "long.csv")
    assert session.share_of_error == pytest.approx(4 / 5)
    assert session.share_of_samples == pytest.approx(2 / 3)
    assert session.excess == pytest.approx(4 / 5 - 2 / 3)


def test_what_happened_once_is_placed_in_its_session():
    """All error sits in a fiftieth of the second session, at a time and a position that the first passed without any."""
    struck = np.zeros(COUNT)
    struck[600:624] = [3.0, -3.0] * 12
    row = where_it_fails([prediction(np.zeros(COUNT), "calm.csv"), prediction(struck, "struck.csv")])[0]
    assert (row.variable, row.label) == ("time", "struck.csv")
    assert (row.from_, row.to) == pytest.approx((6.0, 6.23))
    assert row.share_of_error == pytest.approx(1.0)
    assert row.share_of_samples == pytest.approx(0.01)
    assert row.excess == pytest.approx(0.99)
    # what comes back at the same time of every session is of no one's
    both = at(where_it_fails([prediction(struck, "a.csv"), prediction(struck, "b.csv")]), "time")
    assert both.label is None
    # and where the error is the same everywhere there is no such stretch
    assert "time" not in {row.variable for row in where_it_fails([prediction(np.ones(COUNT))])}


def test_temperature_is_asked_only_where_every_session_has_it():
    residual = np.zeros(COUNT)
    residual[:100] = 1.0
    warm = prediction(residual, temperature=np.linspace(20, 40, COUNT))
    cold = prediction(residual)
    assert at(where_it_fails([warm, warm]), "temperature").to == pytest.approx(20 + 20 / 12, abs=0.05)
    assert "temperature" not in {row.variable for row in where_it_fails([warm, cold])}
