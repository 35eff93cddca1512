"""Forward dynamics of an identified arm against Pinocchio's articulated-body algorithm."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pinocchio as pin
import pytest

from identify.dynamics.geometry import Geometry
from identify.identification import identify
from identify.recording.experiment_file import ExperimentFile
from identify.recording.samples import RawSamples
from identify.recording.session import SessionEntry
from identify.simulation.forward_dynamics import accelerations
from identify.simulation.measured_motion import measured_motions
from identify.simulation.rollout import energy_drift, roll_out
from identify.simulation.torque_model import TorqueModel, Windows
from tests.identify.dynamics.random_robots import pinocchio_model
from tests.identify.estimation.simulated_arm import MemoryExperiment

RATE = 500.0
INERTIAS = ((4.0, 0.3), (2.5, 0.25), (1.2, 0.15))
"""mass, kg, and distance of the centre of mass along x, m, of each link"""


def declared_arm() -> ExperimentFile:
    joints = [
        {"name": "j1", "type": "revolute", "drive_gain": 1.0},
        {"name": "j2", "type": "revolute", "alpha": -np.pi / 2, "drive_gain": 1.0},
        {"name": "j3", "type": "revolute", "d": 0.4, "drive_gain": 1.0},
    ]
    return ExperimentFile.model_validate(
        {
            "format": 1,
            "name": "three joints",
            "robot": {"gravity": [0.0, 0.0, -9.81], "joints": joints},
            "payloads": [{"name": "none", "mass": 0.0}],
            "sessions": [{"file": "s0.csv", "payload": "none"}],
        }
    )


def oracle(geometry: Geometry) -> pin.Model:
    model = pinocchio_model(geometry)
    for joint, (mass, centre) in enumerate(INERTIAS):
        inertia = np.diag([0.02, 0.05, 0.06]) * mass
        model.inertias[joint + 1] = pin.Inertia(mass, np.array([centre, 0.02, -0.01]), inertia)
    return model


def course(time):
    """Three joints on sums of sinusoids, with derivatives in closed form."""
    random = np.random.default_rng(3)
    amplitude = random.uniform(0.15, 0.35, (3, 4))
    omega = 2 * np.pi * np.array([0.11, 0.27, 0.53, 0.81])
    phase = random.uniform(0, 2 * np.pi, (3, 4))
    angle = omega * time[:, None, None] + phase
    return (
        (amplitude * np.sin(angle)).sum(-1),
        (amplitude * omega * np.cos(angle)).sum(-1),
        (-amplitude * omega**2 * np.sin(angle)).sum(-1),
    )


@pytest.fixture(scope="module")
def arm():
    """The arm identified from torques that Pinocchio computed."""
    declared = declared_arm()
    time = np.arange(round(20 * RATE)) / RATE
    q, dq, ddq = course(time)
    entry = SessionEntry("s0.csv", Path("memory/s0.csv"), declared.payloads[0], "identification")
    geometry = Geometry.from_robot(declared.robot)
    model = oracle(geometry)
    data = model.createData()
    torque = np.array([pin.rnea(model, data, *sample).copy() for sample in zip(q, dq, ddq, strict=True)])
    experiment = MemoryExperiment(
        declared.name,
        Path("memory/experiment.yaml"),
        declared.robot,
        (entry,),
        declared.payloads,
        declared.signals,
        (),
        raw={"s0.csv": RawSamples(time, q, torque)},
    )
    return identify(experiment, "rigid"), model, entry


def test_accelerations_are_those_of_the_articulated_body_algorithm(arm):
    result, model, entry = arm
    data = model.createData()
    random = np.random.default_rng(8)
    q, dq, torque = (
        random.uniform(-2, 2, (50, 3)),
        random.uniform(-2, 2, (50, 3)),
        random.uniform(-30, 30, (50, 3)),
    )
    exact = np.array([pin.aba(model, data, *sample).copy() for sample in zip(q, dq, torque, strict=True)])
    fitted = TorqueModel(result.fitted, entry)
    windows = Windows(np.zeros(50), q, dq, np.sign(dq))
    found, _ = accelerations(fitted, windows, torque, np.zeros((50, 3)))
    # the filters leave 1e-4 of the torque in the identified parameters
    assert np.max(np.abs(found - exact)) < 2e-3 * np.max(np.abs(exact))


def test_with_the_true_parameters_they_agree_to_rounding(arm):
    result, model, entry = arm
    standard = np.zeros(33)
    for joint in range(3):
        inertia = model.inertias[joint + 1]
        about_origin = inertia.inertia - inertia.mass * pin.skew(inertia.lever) @ pin.skew(inertia.lever)
        moments = inertia.mass * inertia.lever
        xx, xy, xz = about_origin[0]
        yy, yz, zz = about_origin[1, 1], about_origin[1, 2], about_origin[2, 2]
        standard[11 * joint : 11 * joint + 10] = xx, xy, xz, yy, yz, zz, *moments, inertia.mass
    chi = result.fitted.fit.chi.copy()
    chi[: result.fitted.observation.base] = result.fitted.record.body.base.from_standard(standard)
    chi[result.fitted.observation.base :] = 0.0
    exact_model = replace(result.fitted, fit=replace(result.fitted.fit, chi=chi))
    data = model.createData()
    random = np.random.default_rng(9)
    q, dq, torque = (
        random.uniform(-2, 2, (50, 3)),
        random.uniform(-2, 2, (50, 3)),
        random.uniform(-30, 30, (50, 3)),
    )
    exact = np.array([pin.aba(model, data, *sample).copy() for sample in zip(q, dq, torque, strict=True)])
    windows = Windows(np.zeros(50), q, dq, np.sign(dq))
    found, _ = accelerations(TorqueModel(exact_model, entry), windows, torque, np.zeros((50, 3)))
    assert found == pytest.approx(exact, rel=1e-7, abs=1e-7)


def test_a_second_ahead_the_arm_is_where_it_was_measured_and_keeps_its_energy(arm):
    result, _, entry = arm
    (motion,) = measured_motions(result.fitted.record, entry)
    model = TorqueModel(result.fitted, entry)
    samples = round(1.0 / motion.period)
    simulated = roll_out(model, motion, [0, 1000, 3000], samples)
    rows = simulated.starts[None, :] + np.arange(samples)[:, None]
    assert np.max(np.abs(simulated.q - motion.q[rows])) < 2e-3
    drift = energy_drift(model, motion, simulated)
    assert drift is not None
    assert drift < 1e-5
