"""What is read from a fitted model: its deviations, its torque by terms, and its columns with a load of its own."""

from __future__ import annotations

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

from identify.estimation import fitted_model
from identify.estimation.context import FittedTorque
from identify.estimation.estimate import Estimate
from identify.estimation.fitted_model import FittedModel
from identify.estimation.least_squares import least_squares
from tests.identify.estimation.synthetic_observation import single

CHI = np.array([3.0, -2.0, 0.5, 7.0])
BASE = 2


def fitted(columns=(0, 1, 2, 3), follows=True, load_from=None, **more) -> FittedModel:
    """Two inertial columns, and one term with two."""
    W = np.random.default_rng(1).normal(size=(400, 4))
    Y = W @ CHI + 0.1 * np.random.default_rng(2).normal(size=400)
    observed = single(W, Y)
    observed.slot_columns, observed.base = [np.array([2, 3])], BASE
    return FittedModel(
        record="record",
        model="model",
        slots=(SimpleNamespace(follows_fit=follows),),
        entries=("a", "b"),
        observation=observed,
        fit=least_squares(observed, columns),
        load_from=load_from,
        estimates_payload_ratio=False,
        **more,
    )


@pytest.fixture
def observing(monkeypatch):
    """What is observed anew is another record, on which the same parameters leave more."""
    asked = []

    def observe(record, entries, slots, load_from):
        asked.append((record, tuple(entries), slots, load_from))
        return "observed anew"

    monkeypatch.setattr(fitted_model, "observe", observe)
    monkeypatch.setattr(
        fitted_model, "residual_norms", lambda observation, chi: np.array([len(observation), *chi])
    )
    return asked


def test_the_torque_has_the_inertial_parameters_and_those_of_each_term():
    model = fitted()
    torque = model.torque
    assert torque.chi == pytest.approx(CHI[:2], abs=0.05)
    ((slot, values),) = torque.factors
    assert slot is model.slots[0]
    assert values == pytest.approx(CHI[2:], abs=0.05)


def test_deviations_are_those_of_eq_13_to_15_unless_another_estimator_has_its_own():
    """σ² = ‖ρ‖² / (rows − parameters), C = σ² (WᵀW)⁻¹, by hand on the same matrices."""
    W = np.random.default_rng(1).normal(size=(400, 4))
    noise = 0.1 * np.random.default_rng(2).normal(size=400)
    chi = np.linalg.lstsq(W, W @ CHI + noise, rcond=None)[0]
    variance = np.sum((W @ CHI + noise - W @ chi) ** 2) / (400 - 4)
    model = fitted()
    classical, robust = model.deviations
    np.testing.assert_allclose(classical, np.sqrt(variance * np.diag(np.linalg.inv(W.T @ W))), rtol=1e-9)
    assert robust == pytest.approx(classical, rel=0.9)
    std, coloured = np.arange(4.0), 2.0 * np.arange(4.0)
    other = fitted(estimate=Estimate(model.fit, std, coloured, ()))
    assert other.deviations[0] is std
    assert other.deviations[1] is coloured


def test_other_sessions_are_observed_with_the_same_columns(observing):
    model = fitted(load_from="load")
    assert model.observe(["c"]) == "observed anew"
    assert observing == [("record", ("c",), model.slots, "load")]


def test_columns_that_follow_the_load_come_to_follow_the_model_s_own(observing):
    load = FittedTorque(np.zeros(BASE))
    model = fitted(load_from=load)
    own = model.with_own_load()
    ((record, entries, slots, load_from),) = observing
    assert (record, entries, slots) == ("record", ("a", "b"), model.slots)
    np.testing.assert_array_equal(load_from.chi, model.fit.chi[:BASE])
    assert own.load_from is load_from
    assert own.observation == "observed anew"
    np.testing.assert_array_equal(own.fit.chi, model.fit.chi)
    np.testing.assert_array_equal(own.fit.residual, [len("observed anew"), *model.fit.chi])
    assert own.estimate is None
    estimated = fitted(
        load_from=load, estimate=Estimate(model.fit, np.ones(4), np.ones(4), ())
    ).with_own_load()
    assert estimated.estimate.fit is estimated.fit


@pytest.mark.parametrize(
    "given",
    [
        {"columns": (2, 3)},  # no arm whose load could be followed
        {"follows": False},
    ],
)
def test_a_model_whose_columns_follow_no_load_of_its_own_stays_as_it_is(observing, given):
    model = fitted(load_from=FittedTorque(np.zeros(BASE)), **given)
    assert model.with_own_load() is model
    assert observing == []


def test_a_model_that_has_its_own_load_already_stays_as_it_is(observing):
    first = fitted()
    model = replace(first, load_from=first.torque)
    assert model.with_own_load() is model
    assert observing == []
    other = replace(first, load_from=FittedTorque(first.torque.chi + 1e-9, first.torque.factors))
    assert other.with_own_load() is not other


def test_one_column_of_the_arm_is_an_arm(observing):
    assert fitted(columns=(1, 2, 3), load_from=None).with_own_load().observation == "observed anew"
