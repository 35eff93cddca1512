"""The paper's joint, simulated forward with stick and slip: what the payload sessions tell, and what one without does not."""

from __future__ import annotations

from pathlib import Path

import pytest

import identify
from identify.diagnosis.improvement import improve
from tests.plants.rx130l_joint3 import PAYLOAD_MASSES, write_experiment

LOAD_FRICTION = {"load-friction", "load-friction-asymmetric"}


@pytest.fixture(scope="module")
def with_payloads(tmp_path_factory) -> Path:
    folder = tmp_path_factory.mktemp("rx130l")
    write_experiment(
        folder, seed=5, duration=20.0, rate=250.0, payload_masses=PAYLOAD_MASSES, validation_masses=(3.4584,)
    )
    return folder


@pytest.fixture(scope="module")
def loaded(with_payloads) -> dict:
    return identify.diagnose(identify.load_experiment(with_payloads)).document()


@pytest.fixture(scope="module")
def bare(tmp_path_factory) -> dict:
    folder = tmp_path_factory.mktemp("bare")
    write_experiment(folder, seed=5, duration=20.0, rate=250.0, payload_masses=(0.0,))
    return identify.diagnose(identify.load_experiment(folder)).document()


def candidates(diagnosis: dict) -> dict[str, dict]:
    return {candidate.effect: candidate for candidate in diagnosis.joints[0].candidates}


def test_from_usual_the_diagnosis_arrives_at_friction_that_depends_on_load_and_velocity(loaded):
    joint = loaded.joints[0]
    assert joint.verdict == "missing"
    assert joint.missing[0] == "load-friction-asymmetric"
    assert "load-stribeck" in joint.missing[1:]
    assert joint.candidates[0].effect == "load-friction-asymmetric"
    assert loaded.relative_error_with_missing < 0.2 * loaded.relative_error


def test_improve_takes_both_and_they_hold_on_a_session_it_did_not_see(with_payloads):
    story = improve(identify.load_experiment(with_payloads))
    added = [step.added.effect.name for step in story.steps[1:]]
    assert added[:2] == ["load-friction-asymmetric", "load-stribeck"]
    checked = [step.relative_error_validation for step in story.steps[:3]]
    assert checked[1] < 0.5 * checked[0]
    assert checked[2] < 0.8 * checked[1]


def test_with_payloads_nothing_is_in_doubt_for_want_of_a_load(loaded):
    assert all(candidate.caution is None for candidate in loaded.joints[0].candidates)
    found = candidates(loaded)
    for name in ("load-friction-asymmetric", "load-stribeck"):
        assert not found[name].indistinguishable_from


def test_without_payload_changes_every_load_effect_says_what_it_could_not_have_known(bare):
    found = candidates(bare)
    for name in (LOAD_FRICTION | {"load-stribeck"}) & found.keys():
        assert "cannot be known without a change of payload" in found[name].caution
    assert "load-stribeck" in found["stribeck"].caution
    assert found["viscous-asymmetric"].caution is None


def test_without_payload_changes_the_fall_at_low_speed_is_not_told_from_one_that_grows_with_the_load(bare):
    """The folds alone would decide for the wrong one here: the plant's fall is that of its load."""
    found = candidates(bare)
    missing = set(bare.joints[0].missing)
    assert missing & LOAD_FRICTION
    (named,) = missing & {"stribeck", "load-stribeck"}
    (other,) = {"stribeck", "load-stribeck"} - {named}
    assert other in found[named].indistinguishable_from
    assert named in found[other].indistinguishable_from


def test_without_payload_changes_asymmetric_load_friction_is_not_told_from_symmetric(bare):
    found = candidates(bare)
    first = next(name for name in bare.joints[0].missing if name in LOAD_FRICTION)
    assert found[first].indistinguishable_from
    assert LOAD_FRICTION - {first} <= set(found[first].indistinguishable_from)
