"""`identify` on machines that others have measured and identified before."""

from __future__ import annotations

import json

import pytest

import identify

CONTRACT_KEYS = {
    "experiment", "model", "effects", "relative_error", "relative_error_validation", "joints", "sessions",
    "parameters", "condition_number", "samples",
}  # fmt: skip


@pytest.fixture(scope="module")
def emps_usual(emps):
    return identify.identify(identify.load_experiment(emps), "usual")


@pytest.fixture(scope="module")
def tx40_coupled(tx40):
    return identify.identify(identify.load_experiment(tx40), "usual", ["coupled-friction"])


def test_emps_has_the_published_parameters(emps_usual):
    found = {parameter.name: parameter.value for parameter in emps_usual.parameters}
    assert found["M1R"] == pytest.approx(95.11, abs=0.1)
    assert found["FV1"] == pytest.approx(203.5, abs=1.5)
    assert found["FC1"] == pytest.approx(20.39, abs=0.15)
    assert found["offset1"] == pytest.approx(-3.165, abs=0.05)


def test_emps_has_the_published_relative_error(emps_usual):
    assert emps_usual.relative_error == pytest.approx(0.0404, abs=0.001)


def test_emps_is_explained_better_with_asymmetric_viscous_friction(emps):
    found = identify.identify(identify.load_experiment(emps), "usual", ["viscous-asymmetric"])
    assert found.relative_error <= 0.031


REFERENCE = {  # relative errors in percent, identification and validation: the data's own README
    "j1": (4.2, 7.3),
    "j2": (4.1, 6.8),
    "j3": (7.0, 11.5),
    "j4": (6.8, 9.5),
    "j5": (10.5, 33.8),
    "j6": (7.2, 21.2),
}


@pytest.mark.parametrize("joint", REFERENCE)
def test_the_tx40_is_no_worse_than_the_reference(tx40_coupled, joint):
    found = {own.joint: own for own in tx40_coupled.document().joints}[joint]
    identification, validation = REFERENCE[joint]
    assert 100 * found.relative_error <= 1.03 * identification
    assert 100 * found.relative_error_validation <= 1.03 * validation


def test_the_document_has_every_key_of_the_contract(tx40_coupled):
    document = json.loads(tx40_coupled.document().json_text())
    assert document.keys() >= CONTRACT_KEYS
    assert [own["joint"] for own in document["joints"]] == ["j1", "j2", "j3", "j4", "j5", "j6"]
    for own in document["joints"]:
        assert own.keys() >= {"joint", "relative_error", "relative_error_validation", "noise_floor"}
        assert own["noise_floor"] is None  # no part of the motion repeats
    for own in document["sessions"]:
        assert own.keys() >= {"file", "payload", "relative_error"}
    for own in document["parameters"]:
        assert own.keys() >= {
            "name", "joint", "value", "std", "std_robust", "relative_std_percent", "unit", "grouping",
        }  # fmt: skip
    assert {"effect": "coupled-friction", "joint": "j6"} in document["effects"]


def test_without_a_validation_session_its_errors_are_null(emps_usual):
    document = emps_usual.document()
    assert document.relative_error_validation is None
    assert document.joints[0].relative_error_validation is None
    assert document.joints[0].noise_floor == pytest.approx(0.0062, abs=0.001)
