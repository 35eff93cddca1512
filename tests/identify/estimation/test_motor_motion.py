"""Friction of gears whose motors share axes: identified in the motors' velocities and loads, and exported so."""

from __future__ import annotations

import shutil
from dataclasses import replace

import numpy as np
import pytest

from identify.export.c_code import c_code
from identify.export.compiled import compiled_torque
from identify.export.exported_model import exported_model
from identify.export.iec61131.function_block import FunctionBlock
from identify.export.planned_torque import planned_torque
from identify.export.record_error import Motion
from identify.export.structured_text import structured_text
from identify.identification import identify
from identify.simulation.torque_model import TorqueModel, Windows
from tests.identify.estimation.shared_motor_arm import GAINS, SharedMotorArm, experiment

ARM = SharedMotorArm()
COMPILER = shutil.which("cc") or shutil.which("gcc")
SYMBOLS = ("a_m", "b_m", "a_g", "b_g", "c_m", "d_m", "c_g", "d_g")
SHARED = ["coupled-friction", "load-friction-asymmetric", "stribeck", "load-stribeck"]
"""the terms of eq. (30) as effects of the catalogue"""


@pytest.fixture(scope="module")
def recorded():
    return experiment(ARM, {"none": 0.0, "disk": 3.0}, 20.0)


@pytest.fixture(scope="module")
def result(recorded):
    return identify(recorded, "load-velocity")


@pytest.fixture(scope="module")
def by_effects(recorded):
    return identify(recorded, "usual", SHARED)


@pytest.fixture(scope="module")
def motion():
    """States that no session had."""
    random = np.random.default_rng(7)
    q, dq, ddq = (scale * random.uniform(-1, 1, (60, 2)) for scale in (1.2, 1.5, 4.0))
    return q, dq, ddq


def along(result, motion):
    """The exported torque of the bare arm, and the fitted model's own."""
    q, dq, ddq = motion
    time = np.linspace(0, 1, len(q))
    planned = planned_torque(
        exported_model(result), Motion(time, q, dq, ddq, None, result.experiment.payloads[0])
    )
    fitted = result.fitted if result.structured is None else result.structured.fitted
    model = TorqueModel(fitted, result.experiment.sessions[0])
    return planned.whole, model.torque(Windows(time, q, dq, np.sign(dq)), ddq)


def test_each_gear_has_the_plant_s_parameters(result):
    found = {own.name: own.value for own in result.structured_parameters}
    for name, gear in zip(("j1", "j2"), ARM.gears, strict=True):
        for symbol in SYMBOLS:
            assert found[f"{symbol}@{name}"] == pytest.approx(getattr(gear, symbol), rel=0.03), (symbol, name)
    assert (found["FV1"], found["FVM2"]) == pytest.approx([gear.viscous for gear in ARM.gears], rel=0.01)
    # nothing rubs on the second joint's own side
    assert max(abs(found["FV2"]), abs(found["FC2"])) < 0.02
    assert result.document().structured.relative_error < 1e-3


def test_the_start_of_sliding_is_found_in_the_motor_s_velocity(result):
    searched = [
        own.values["stribeck_velocity"]
        for own in result.document().constants
        if own.effect == "load-velocity"
    ]
    assert searched == pytest.approx([gear.stribeck_velocity for gear in ARM.gears], rel=0.05)


def test_effects_of_the_catalogue_find_the_same_friction(by_effects):
    found = {own.name: own.value for own in by_effects.parameters}
    for number, gear in enumerate(ARM.gears, start=1):
        assert found[f"alpha_m{number}"] == pytest.approx(gear.a_m - 1, rel=0.05)
        assert found[f"alpha_g{number}"] == pytest.approx(1 - gear.a_g, rel=0.05)
        assert found[f"beta_difference{number}"] == pytest.approx(gear.c_m - gear.c_g, rel=0.1)
    assert by_effects.relative_error < 1e-3


def test_in_the_joints_own_coordinates_the_friction_is_in_no_model(recorded, by_effects):
    usual = identify(recorded, "usual")
    assert usual.relative_error > 30 * by_effects.relative_error


def test_exports_are_the_model_and_both_are_the_plant(result, by_effects, motion, tmp_path):
    q, dq, ddq = motion
    true = ARM.torque(q, dq, ddq, 0.0)
    for name, found, part in (("arm", result, 2e-3), ("other", by_effects, 2e-2)):
        planned, fitted = along(found, motion)
        assert planned == pytest.approx(fitted, rel=1e-9, abs=1e-9)
        assert np.sqrt(np.mean((planned - true) ** 2)) < part * np.sqrt(np.mean(true**2))
        model = exported_model(found)
        block = FunctionBlock(structured_text(model, "arm"), "arm.st")
        torque = block.call({"Q": q, "DQ": dq, "DDQ": ddq}, "TORQUE")
        assert torque == pytest.approx(planned, rel=1e-9, abs=1e-9)
        if COMPILER is not None:
            source, header = c_code(model, name)
            (tmp_path / f"{name}.c").write_text(source)
            (tmp_path / f"{name}.h").write_text(header)
            torque_of = compiled_torque(COMPILER, tmp_path / f"{name}.c")
            asked = Motion(np.zeros(60), q, dq, ddq, None, found.experiment.payloads[0])
            assert torque_of(asked) == pytest.approx(planned, rel=1e-9, abs=1e-9)


def test_motors_of_their_own_declared_by_a_matrix_give_the_same_to_the_bit():
    apart = experiment(SharedMotorArm(r=0.0), {"none": 0.0, "disk": 3.0}, 5.0)
    joints = [
        joint.model_copy(update={"drive_gain": gain})
        for joint, gain in zip(apart.robot.joints, GAINS.tolist(), strict=True)
    ]
    scalars = replace(
        apart, robot=apart.robot.model_copy(update={"joints": tuple(joints), "drive_gain_matrix": None})
    )
    first, second = (identify(each, "load-velocity") for each in (apart, scalars))
    assert [own.value for own in first.structured_parameters] == [
        own.value for own in second.structured_parameters
    ]
    assert "IaM2" not in {own.name for own in first.structured_parameters}


def test_what_the_motion_does_not_tell_of_a_gear_is_held_and_said():
    """Without a known load, and hardly ever slow, a weak gear's friction at low speed and over the load is not told."""
    fast = experiment(ARM, {"none": 0.0}, 8.0, noise=3.0)
    found = identify(fast, "load-velocity")
    held = {own.name: own for own in found.structured_parameters if own.doubt}
    assert {"b_m@j2", "b_g@j2"} <= held.keys()
    assert all(own.std is None and own.value in (0.0, 1.0) for own in held.values())
    (remark,) = [own for own in found.all_remarks if own.startswith("j2: the motion does not tell")]
    assert "how the load's share of friction changes at low speed" in remark
