"""Bodies with mass that have the identified base parameters of the one-joint arm."""

from __future__ import annotations

import numpy as np
import pytest

import identify
from identify.estimation.feasible import pseudo_inertia
from identify.export.exported_model import exported_model
from tests.identify.estimation.simulated_arm import Arm, Motion, experiment, record

pytest.importorskip("cvxpy", reason="the extra 'feasible' is not installed")

from identify.export.bodies import feasible_standard


def bodies_of(arm, rotors=True):
    raw = record(Motion(), arm, np.random.default_rng(2), duration=10.0, torque_noise=0.5)
    model = exported_model(identify.identify(experiment({"a": (raw, "none")}), "usual"))
    result = identify.identify(experiment({"a": (raw, "none")}), "usual")
    return model, *feasible_standard(result, model, rotors)


@pytest.mark.parametrize("rotors", [True, False])
def test_bodies_of_a_real_arm_keep_its_base_parameters_to_the_last_digits(rotors):
    model, standard, kept = bodies_of(Arm(), rotors)
    assert kept
    assert np.linalg.eigvalsh(pseudo_inertia(standard)).min() > 0
    assert standard[10] >= 0
    assert rotors or standard[10] == 0
    np.testing.assert_allclose(
        model.base.from_standard(standard), model.chi, atol=1e-8 * np.abs(model.chi).max()
    )
    assert standard[5] + standard[10] == pytest.approx(Arm().inertia, rel=0.02)


def test_an_estimate_that_no_body_has_is_not_kept_and_what_is_given_instead_is_one():
    """A negative inertia about the axis: no body has it, and what is nearest is said to be another."""
    model, standard, kept = bodies_of(Arm(inertia=-3.0))
    assert model.chi[list(model.base.names).index("ZZ1R")] < 0
    assert not kept
    assert np.linalg.eigvalsh(pseudo_inertia(standard)).min() > -1e-6
    assert standard[10] >= 0
