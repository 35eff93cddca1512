"""The diagnosis on a plant that shares no code with it, and on measured machines."""

from __future__ import annotations

import json
import shutil
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
import yaml

import identify
from tests.plants.shared_belts import Belt, write_arm, write_gantry

CLEAR = {
    "viscous-asymmetric": 0.5,
    "viscous-cubic": 0.5,
    "stribeck": 0.5,
    "load-friction": 0.5,
    "load-stribeck": 0.5,
    "friction-position": 0.5,
    "friction-warmup": 0.5,
    "presliding": 0.5,
    "joint-spring": 0.5,
    "torque-ripple": 0.5,
    "current-ripple": 0.5,
    "gain-saturation": 0.5,
    "delay": 0.5,
    "gravity-tilt": 1.0,
    "payload-com": 1.0,
}


@pytest.mark.parametrize(("effect", "strength"), CLEAR.items())
def test_a_single_hidden_effect_is_named_first(diagnosed, effect, strength):
    joint = diagnosed((effect, strength)).joints[0]
    assert joint.verdict == "missing"
    assert joint.missing[0].effect.name == effect
    assert joint.findings[0].candidate.name == effect


def test_a_weak_effect_is_told_from_its_twin_by_what_each_explains_beside_the_other(diagnosed):
    said = diagnosed(("load-stribeck", 0.2)).joints[0]
    assert said.missing[0].effect.name == "load-stribeck"
    assert "stribeck" not in said.rivals.get("load-stribeck", ())


def test_two_payloads_are_enough_to_name_a_friction_that_follows_the_load(diagnosed):
    """Each session alone tells next to nothing of it, and is not asked to foretell the other."""
    said = diagnosed(("load-friction-asymmetric", 1.0), payloads=(1.0, 4.0)).joints[0]
    assert said.missing[0].effect.name == "load-friction-asymmetric"


def late(
    source: Path,
    folder: Path,
    commands: Callable[[np.ndarray], np.ndarray],
    progress: Callable[[float, str], None] | None = None,
) -> identify.Diagnosis:
    """The diagnosis of an experiment whose recorded command is changed in every session."""
    shutil.copytree(source, folder)
    for file in folder.glob("*.csv"):
        names = file.read_text().splitlines()[0].split(",")
        rows = np.loadtxt(file, delimiter=",", skiprows=1)
        rows[:, names.index("v1")] = commands(rows[:, names.index("v1")])
        np.savetxt(file, rows, fmt="%.9g", delimiter=",", header=",".join(names), comments="")
    return identify.diagnose(identify.load_experiment(folder), progress=progress)


def test_a_command_that_is_held_over_its_period_is_no_fault(hidden, tmp_path):
    """Recorded as the period starts it is early by half of one; what is early by a third of one, or by two, is a delay."""

    def early(samples: int) -> Callable[[np.ndarray], np.ndarray]:
        return lambda command: np.append(command[samples:], np.repeat(command[-1], samples))

    held = late(hidden(), tmp_path / "held", lambda v: (v + early(1)(v)) / 2).joints[0]
    assert held.verdict == "adequate"
    assert held.missing == ()
    assert "held over its period" in held.cautions["delay"]
    parts: list[float] = []
    third = late(hidden(), tmp_path / "third", lambda v: (2 * v + early(1)(v)) / 3).joints[0]
    assert [term.effect.name for term in third.missing] == ["delay"], "certainly not half a period"
    delayed = late(hidden(), tmp_path / "late", early(2), lambda part, _: parts.append(part)).joints[0]
    assert [term.effect.name for term in delayed.missing][:1] == ["delay"]
    # nobody knows how many rounds a search takes: each comes nearer to the end, and none goes beyond
    assert (parts[0], parts[-1]) == (0.0, 1.0)
    assert parts == sorted(set(parts))


def test_an_error_that_only_a_validation_session_shows_is_not_adequate(hidden, tmp_path):
    folder = tmp_path / "experiment"
    shutil.copytree(hidden(), folder)
    described = yaml.safe_load((folder / "experiment.yaml").read_text())
    described["sessions"][-1]["role"] = "validation"
    described["payloads"][-1]["mass"] *= 1.2
    (folder / "experiment.yaml").write_text(yaml.safe_dump(described))
    said = identify.diagnose(identify.load_experiment(folder)).joints[0]
    assert said.verdict == "unexplained"
    assert {"session", "payload"} & {row.variable for row in said.where[:3]}


def test_nothing_is_blamed_where_nothing_is_hidden(diagnosed):
    for seed in (11, 12, 13):
        joint = diagnosed(seed=seed).joints[0]
        assert joint.verdict == "adequate"
        assert joint.missing == ()


@pytest.mark.parametrize("effect", ["one-sided-bumper", "sloshing", "shaking-base"])
def test_an_effect_of_no_catalogue_is_called_unexplained(diagnosed, effect):
    assert diagnosed((effect, 1.0)).joints[0].verdict == "unexplained"


def test_both_of_two_hidden_effects_are_named(diagnosed):
    joint = diagnosed(("viscous-asymmetric", 0.6), ("joint-spring", 0.6)).joints[0]
    assert {"viscous-asymmetric", "joint-spring"} <= {term.effect.name for term in joint.missing}


def test_asymmetric_load_friction_is_told_from_symmetric_by_the_payloads(diagnosed):
    said = diagnosed(("load-friction-asymmetric", 1.0)).joints[0]
    assert said.missing[0].effect.name == "load-friction-asymmetric"


def test_without_payload_a_wrong_drive_gain_could_not_have_been_known(diagnosed):
    said = diagnosed(payloads=(0.0,)).document()
    reasons = {row.effect: row.reason for row in said.not_applicable}
    assert "known load" in reasons["drive-gain"]
    assert "payload" in reasons["payload-mass"]


def test_a_payload_of_wrong_mass_cannot_be_told_from_a_wrong_gain_and_that_is_said(diagnosed):
    said = diagnosed(("payload-mass", 1.0)).document().joints[0]
    first = said.candidates[0]
    assert {first.effect, *first.indistinguishable_from} >= {"payload-mass", "drive-gain"}
    # the payload ratio beside which all others are judged explains as much, and is no answer
    assert (said.verdict, said.missing) == ("missing", (first.effect,))


def test_the_json_has_what_the_contract_says(diagnosed):
    said = json.loads(diagnosed(("stribeck", 0.5)).document().json_text())
    assert {"experiment", "model", "relative_error", "noise_floor", "joints"} <= said.keys()
    joint = said["joints"][0]
    assert {"joint", "verdict", "missing", "candidates", "where"} <= joint.keys()
    candidate = joint["candidates"][0]
    assert {
        "effect",
        "rank",
        "relative_error_before",
        "relative_error_after",
        "heldout_error_before",
        "heldout_error_after",
        "p_value",
        "indistinguishable_from",
        "explanation",
    } <= candidate.keys()
    assert [each["rank"] for each in joint["candidates"]] == list(range(1, len(joint["candidates"]) + 1))
    for row in joint["where"]:
        assert {"variable", "from", "to", "share_of_error"} <= row.keys()
        assert 0 <= row["share_of_error"] <= 1


def test_adding_the_named_effect_brings_the_error_to_the_noise(hidden, diagnosed):
    said = diagnosed(("stribeck", 0.5))
    clean = diagnosed().fitted.fit.relative_error
    assert said.fitted.fit.relative_error > 1.5 * clean
    assert said.better.fit.relative_error < 1.15 * clean


def test_emps_names_the_asymmetric_viscous_friction_first(emps):
    said = identify.diagnose(identify.load_experiment(emps)).document().joints[0]
    assert said.candidates[0].effect == "viscous-asymmetric"
    assert said.candidates[0].relative_error_after <= 0.031


@pytest.mark.parametrize(
    ("write", "belt", "parameters"),
    [
        (write_gantry, Belt(1, 1, 3.0, 5.0), {"FVS2": 3.0, "FCS2": 5.0}),
        (write_gantry, Belt(1, -1, 0.0, 0.0, 2.0), {"IaD2": 2.0}),
        (write_arm, Belt(2, -1, 2.0, 3.0), {"FVD3": 2.0, "FCD3": 3.0}),
    ],
)
def test_a_motor_that_two_joints_share_undeclared_is_named_between_them_and_added(
    tmp_path, write, belt, parameters
):
    folder = write(tmp_path / "belts", (belt,), seed=3)
    found = identify.diagnose(identify.load_experiment(folder))
    name = "shared-motor-sum" if belt.side > 0 else "shared-motor-difference"
    one, two = [each.joint for each in found.document().joints][belt.own - 1 : belt.own + 1]
    said = found.document().joint(two)
    assert said is not None
    assert [(each.joint, each.missing) for each in found.document().joints if each.missing] == [
        (two, (name,))
    ]
    explanation = said.candidate(name).explanation
    assert explanation.startswith(f"It looks like a shared motor or belt between {one} and {two}: ")
    added = identify.identify(identify.load_experiment(folder), "usual", [f"{name}@{two}"]).document()
    assert added.relative_error < 0.1 * found.fitted.fit.relative_error
    values = {each.name: each.value for each in added.parameters}
    assert {key: values[key] for key in parameters} == pytest.approx(parameters, rel=0.02)


@pytest.mark.parametrize("write", [write_gantry, write_arm])
def test_joints_with_a_motor_each_share_none(tmp_path, write):
    found = identify.diagnose(identify.load_experiment(write(tmp_path / "alone", (), seed=3)))
    assert [joint.verdict for joint in found.joints] == ["adequate"] * len(found.joints)
