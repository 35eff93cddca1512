"""Parameters that the data do not show are eliminated, those that they show stay."""

from __future__ import annotations

import numpy as np
import pytest

import identify
from tests.identify.estimation import simulated_arm


@pytest.fixture(scope="module")
def reduced():
    arm = simulated_arm.Arm(first_moment=(21.1, 0.0))
    raw = simulated_arm.record(simulated_arm.Motion(), arm, np.random.default_rng(3), torque_noise=5.0)
    experiment = simulated_arm.experiment({"a": (raw, "none")})
    return identify.identify(experiment, "usual", ["viscous-asymmetric"], essential=True).document()


def test_parameters_that_are_zero_in_truth_are_eliminated(reduced):
    assert {own.name for own in reduced.eliminated} == {"MY1", "FVa1"}
    assert {own.name for own in reduced.parameters} == {"ZZ1R", "MX1", "FV1", "FC1", "offset1"}


def test_the_result_says_why_and_what_it_cost(reduced):
    for own in reduced.eliminated:
        assert own.relative_std_percent > 51
        assert own.relative_error_before <= own.relative_error_after
        assert own.relative_error_after == pytest.approx(own.relative_error_before, rel=0.01)
    assert any("2 parameters eliminated one by one" in remark for remark in reduced.remarks)


def test_what_stays_is_estimated_again(reduced):
    found = {own.name: own for own in reduced.parameters}
    assert found["MX1"].value == pytest.approx(21.1, abs=4 * found["MX1"].std_robust)
    assert all(own.relative_std_percent < 51 for own in found.values())


def test_without_being_asked_nothing_is_eliminated():
    raw = simulated_arm.record(simulated_arm.Motion(), simulated_arm.Arm(), np.random.default_rng(3))
    assert identify.identify(simulated_arm.experiment({"a": (raw, "none")})).document().eliminated == ()
