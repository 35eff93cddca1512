"""The structure of the paper's Tables I-IV on the simulated RX130L joint 3, whose numbers are known."""

from __future__ import annotations

import numpy as np
import pytest

import identify
from tests.plants.rx130l_joint3 import Rx130lJoint3, write_experiment

PLANT = Rx130lJoint3(declared_gain_error=-0.06)
GAIN = 0.94


@pytest.fixture(scope="module")
def experiment(tmp_path_factory):
    folder = tmp_path_factory.mktemp("rx130l")
    write_experiment(folder, PLANT, seed=5, duration=45.0, validation_masses=(3.4584,))
    return identify.load_experiment(folder)


@pytest.fixture(scope="module")
def usual(experiment):
    return identify.identify(experiment, "usual")


@pytest.fixture(scope="module")
def load_velocity(experiment):
    return identify.identify(experiment, "load-velocity", essential=True)


def values(parameters):
    return {parameter.name: parameter.value for parameter in parameters}


def test_table_1_the_usual_model_finds_inertia_gravity_and_payloads_as_the_gain_scales_them(usual):
    found = values(usual.document().parameters)
    assert found["ZZ1R"] == pytest.approx(GAIN * PLANT.inertia, rel=0.03)
    assert found["MX1"] == pytest.approx(GAIN * PLANT.first_moment_x, rel=0.03)
    ratios = [value for name, value in found.items() if name.startswith("mass_ratio")]
    assert len(ratios) == 2
    assert np.allclose(ratios, GAIN, atol=0.05)


def test_table_2_the_products_of_the_sliding_friction_are_the_plants(load_velocity):
    found = values(load_velocity.document().parameters)
    p = PLANT
    for name, value in {
        "a_m·ZZ1R": p.a_m * p.inertia,
        "a_m·MX1": p.a_m * p.first_moment_x,
        "a_m": p.a_m,
        "a_g·ZZ1R": p.a_g * p.inertia,
        "a_g·MX1": p.a_g * p.first_moment_x,
        "a_g": p.a_g,
        "c_m": p.c_m,
        "c_g": p.c_g,
        "FV1": p.viscous,
        "offset1": p.offset,
    }.items():
        assert found[name] == pytest.approx(GAIN * value, rel=0.05), name


def test_the_structured_estimate_has_the_plants_one_inertia_and_one_first_moment(load_velocity):
    found = values(load_velocity.document().structured.parameters)
    assert found["ZZ1R"] == pytest.approx(PLANT.inertia, rel=0.01)
    assert found["MX1"] == pytest.approx(PLANT.first_moment_x, rel=0.01)


def test_friction_at_the_start_of_sliding_is_found_because_stops_are_left_out(load_velocity):
    """b_m, b_g and the Stribeck velocity live in the few samples beside the stiction area of eq. (26)."""
    document = load_velocity.document()
    found = values(document.structured.parameters)
    assert found["b_m"] == pytest.approx(GAIN * PLANT.b_m, rel=0.1)
    assert found["b_g"] == pytest.approx(GAIN * PLANT.b_g, rel=0.1)
    velocity = next(
        e.values["stribeck_velocity"] for e in document.constants if "stribeck_velocity" in e.values
    )
    assert velocity == pytest.approx(PLANT.stribeck_velocity, rel=0.03)
    assert load_velocity.relative_error < 0.004


OTHER = Rx130lJoint3(
    inertia=20.0, first_moment_x=-12.0, first_moment_y=5.0,
    a_m=1.09, b_m=0.05, c_m=15.0, d_m=5.0, a_g=0.88, b_g=0.16, c_g=13.0, d_g=2.0,
    viscous=30.0, offset=-7.0, stribeck_velocity=0.05, declared_gain_error=0.05,
)  # fmt: skip


@pytest.mark.parametrize("plant", [PLANT, OTHER], ids=["the paper's", "another"])
def test_linear_and_structured_parameters_are_the_plants_within_three_robust_deviations(plant, tmp_path):
    write_experiment(tmp_path, plant, seed=3, duration=45.0)
    document = identify.identify(identify.load_experiment(tmp_path), "load-velocity").document()
    truth = true_parameters(plant)
    for form in (document.structured.parameters, document.parameters):
        assert len(form) in (13, 22)
        for parameter in form:
            off = abs(parameter.value - truth[parameter.name])
            assert off < 3 * parameter.std_robust, parameter.name


def true_parameters(plant):
    """Every parameter of both forms, as seen through the declared drive gain."""
    gain = 1.0 + plant.declared_gain_error
    arm = {"ZZ1R": plant.inertia, "MX1": plant.first_moment_x, "MY1": plant.first_moment_y}
    gear = {
        name: gain * getattr(plant, name) for name in ["a_m", "b_m", "a_g", "b_g", "c_m", "d_m", "c_g", "d_g"]
    }
    products = {
        f"{name}·{own}": gear[name] * value
        for name in ("a_m", "b_m", "a_g", "b_g")
        for own, value in arm.items()
    }
    return arm | gear | products | {"FV1": gain * plant.viscous, "offset1": gain * plant.offset}


def test_table_3_the_new_model_lowers_the_error_at_all_speeds_and_on_motion_it_did_not_see(
    usual, load_velocity
):
    for slow_to_fast in ((0.0, 0.1), (0.1, 0.35), (0.35, 1.1)):
        errors = [error_between(result, *slow_to_fast) for result in (usual, load_velocity)]
        assert errors[1] < 0.75 * errors[0], slow_to_fast
    assert load_velocity.relative_error_validation < 0.66 * usual.relative_error_validation


def error_between(result, slowest, fastest):
    """Relative error of the samples whose speed lies between two parts of the highest."""
    parts = [result.prediction(entry.file, "j3") for entry in result.experiment.sessions]
    speed = np.abs(np.concatenate([part.velocity[part.moving] for part in parts]))
    residual = np.concatenate([part.residual[part.moving] for part in parts])
    measured = np.concatenate([part.measured[part.moving] for part in parts])
    chosen = (speed >= slowest * speed.max()) & (speed < fastest * speed.max())
    return np.linalg.norm(residual[chosen]) / np.linalg.norm(measured[chosen])


def test_table_4_the_new_model_is_better_even_without_any_payload(tmp_path):
    write_experiment(tmp_path, PLANT, seed=6, duration=45.0, payload_masses=(0.0,))
    bare = identify.load_experiment(tmp_path)
    errors = [identify.identify(bare, model).relative_error for model in ("usual", "load-velocity")]
    assert errors[1] < 0.81 * errors[0]
    structured = identify.identify(bare, "load-velocity", essential=True)
    assert structured.form == "structured"
    assert any("no elimination" in remark for remark in structured.all_remarks)
