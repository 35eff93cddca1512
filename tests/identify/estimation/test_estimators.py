"""Every estimator on an arm of known parameters, where it is the right one and where least squares is not."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

import identify
from identify.estimation.instrumental_variable import half_of_samples
from tests.identify.estimation import simulated_arm

ARM = simulated_arm.Arm()
MOTION = simulated_arm.Motion()


def identified(sessions, estimator, **options):
    experiment = simulated_arm.experiment(sessions, **options)
    result = identify.identify(experiment, "usual", estimator=estimator)
    return {parameter.name: parameter for parameter in result.parameters}, result


@pytest.mark.parametrize("estimator", ["ordinary", "weighted", "robust", "instrumental"])
def test_every_estimator_finds_the_arm_that_made_clean_data(estimator):
    raw = simulated_arm.record(MOTION, ARM, np.random.default_rng(1), torque_noise=0.5)
    found, result = identified({"a": (raw, "none")}, estimator)
    assert result.document().estimator == estimator
    truth = {"ZZ1R": 30.9, "MX1": 21.1, "MY1": 0.4, "FV1": 29.4, "FC1": 39.9, "offset1": 9.9}
    for name, value in truth.items():
        assert found[name].std_robust is not None
        # the noise through the filters, and the instants of reversal, known to a sample
        assert found[name].value == pytest.approx(value, abs=4 * found[name].std_robust + 2e-3 * 39.9)


def test_instruments_of_a_session_with_a_hole_find_the_arm_from_both_sides_of_it():
    raw = simulated_arm.record(MOTION, ARM, np.random.default_rng(1), torque_noise=0.5)
    there = np.r_[0:4000, 5000 : len(raw.time)]
    holed = replace(raw, time=raw.time[there], position=raw.position[there], command=raw.command[there])
    found, result = identified({"a": (holed, "none")}, "instrumental")
    assert len(result.experiment.read(result.experiment.sessions[0]).segments) == 2
    for name, value in (("ZZ1R", 30.9), ("MX1", 21.1), ("FV1", 29.4), ("FC1", 39.9)):
        assert found[name].value == pytest.approx(value, abs=4 * found[name].std_robust + 2e-3 * 39.9)


def test_the_default_is_ordinary_for_one_joint():
    raw = simulated_arm.record(MOTION, ARM, np.random.default_rng(1), torque_noise=0.5)
    assert identified({"a": (raw, "none")}, None)[1].document().estimator == "ordinary"


def test_an_unknown_estimator_is_refused_in_one_line():
    raw = simulated_arm.record(MOTION, ARM, np.random.default_rng(1))
    with pytest.raises(
        identify.InputError, match="--estimator best: estimators are ordinary, weighted, robust"
    ):
        identified({"a": (raw, "none")}, "best")


def test_huber_is_spoiled_less_by_outliers_than_least_squares():
    worst = {"ordinary": 0.0, "robust": 0.0}
    for seed in range(4):
        random = np.random.default_rng(seed)
        raw = simulated_arm.record(MOTION, ARM, random, torque_noise=0.5)
        raw = simulated_arm.with_outliers(raw, random, share=0.05, size=400.0)
        for estimator in worst:
            found, _ = identified({"a": (raw, "none")}, estimator)
            error = abs(found["offset1"].value - 9.9) + abs(found["MX1"].value - 21.1)
            worst[estimator] = max(worst[estimator], error)
    assert worst["robust"] < 0.25 * worst["ordinary"]


@pytest.fixture(scope="module")
def noisy_encoder():
    """Inertia (values, stated deviations) by least squares and by instruments, 24 draws of a noisy encoder."""
    found = {"ordinary": [], "instrumental": []}
    for seed in range(24):
        random = np.random.default_rng(100 + seed)
        raw = simulated_arm.record(MOTION, ARM, random, torque_noise=1.0, position_noise=1.5e-3)
        for estimator, values in found.items():
            signals = {"position_cutoff": 20.0, "decimation_cutoff": 20.0}
            parameters, _ = identified({"a": (raw, "none")}, estimator, signals=signals)
            values.append((parameters["ZZ1R"].value, parameters["ZZ1R"].std_robust))
    return {estimator: np.array(values) for estimator, values in found.items()}


def test_noise_of_the_encoder_biases_the_inertia_of_least_squares(noisy_encoder):
    values = noisy_encoder["ordinary"][:, 0]
    assert values.mean() < 0.9 * ARM.inertia


def test_instrumental_variables_remove_that_bias(noisy_encoder):
    values = noisy_encoder["instrumental"][:, 0]
    uncertainty = values.std(ddof=1) / np.sqrt(len(values))
    assert uncertainty < 0.01 * ARM.inertia
    assert abs(values.mean() - ARM.inertia) < 3 * uncertainty


def test_the_deviations_of_instrumental_variables_are_those_of_their_scatter(noisy_encoder):
    values, stated = noisy_encoder["instrumental"].T
    assert np.median(stated) == pytest.approx(values.std(ddof=1), rel=0.45)


def test_reference_positions_are_the_instruments_where_there_are_any():
    values = []
    for seed in range(12):
        random = np.random.default_rng(200 + seed)
        raw = simulated_arm.record(MOTION, ARM, random, torque_noise=1.0, position_noise=1.5e-3)
        raw.extra["qref1"] = MOTION.at(raw.time)[0]
        signals = {"position_cutoff": 20.0, "decimation_cutoff": 20.0}
        found, result = identified({"a": (raw, "none")}, "instrumental", signals=signals)
        assert any("reference motion qref" in remark for remark in result.document().remarks)
        values.append(found["ZZ1R"].value)
    uncertainty = np.std(values, ddof=1) / np.sqrt(len(values))
    assert abs(np.mean(values) - ARM.inertia) < 3.5 * uncertainty


def test_half_of_the_samples_knows_nothing_of_the_other_half():
    raw = simulated_arm.record(MOTION, ARM, np.random.default_rng(0), duration=1.0)
    experiment = simulated_arm.experiment({"a": (raw, "none")})
    session = experiment.read(experiment.sessions[0])
    even = half_of_samples(session, 0)
    session.position[1::2][5:-5] += 1.0
    np.testing.assert_array_equal(half_of_samples(session, 0)[8:-8], even[8:-8])
    np.testing.assert_allclose(even[4:-4], MOTION.at(raw.time)[0][4:-4, None], atol=1e-9)
