"""Exports of a robot of six joints whose last motor turns with two of them, opened by the programs that they are for: the
certificate's figures are what those programs' torques give."""

from __future__ import annotations

import importlib.util
from pathlib import Path

import mujoco
import numpy as np
import pinocchio as pin
import pytest

from identify.dynamics.geometry import Geometry
from identify.dynamics.rotations import from_quaternion
from identify.estimation.context import contexts
from identify.export.c_code import c_code
from identify.export.compiled import compiled_torque, compiler_here
from identify.export.document_torque import document_torque
from identify.export.exported_model import RIGID, exported_model
from identify.export.formula_torque import module_of, module_torque
from identify.export.link_files import Body
from identify.export.model_document import model_document
from identify.export.record_error import Motion
from identify.export.structured_text import structured_text
from identify.export.structured_text_torque import structured_text_torque
from identify.export.write import write_export
from identify.identification import identify
from identify.recording.experiment_file import ExperimentFile
from identify.recording.samples import RawSamples
from identify.recording.session import SessionEntry
from tests.identify.dynamics.random_robots import pinocchio_model
from tests.identify.estimation.simulated_arm import MemoryExperiment
from tests.identify.export.described_robot import parameters_of
from tests.identify.export.identified_torque import of_the_model

RATE = 200.0
SECONDS = 20.0
ROTORS = np.array([0.5, 0.4, 0.3, 0.12, 0.08, 0.05])
"""kg m^2, at the joints"""
MASSES = (9.0, 6.0, 3.0, 1.5, 0.8, 0.4)
VISCOUS = np.array([8.0, 7.0, 5.0, 3.0, 2.0, 1.0])
DRY = np.array([6.0, 5.0, 4.0, 2.0, 1.5, 1.0])
ON_MOTOR_6 = (1.2, 0.9)
"""N m s/rad and N m over q̇5 + q̇6, on j5 and on j6"""
LOAD_FRICTION = 0.08
"""of j2's load"""


def declared() -> ExperimentFile:
    frames = [
        (0.0, 0.0, 0.32),
        (-np.pi / 2, 0.0, 0.0),
        (0.0, 0.225, 0.035),
        (np.pi / 2, 0.0, 0.225),
        (-np.pi / 2, 0.0, 0.0),
        (np.pi / 2, 0.0, 0.0),
    ]
    gain = np.diag([32.0, 32.0, 45.0, -48.0, 45.0, 32.0])
    gain[4, 5] = 32.0
    joints = [
        {"name": f"j{j + 1}", "type": "revolute", "alpha": alpha, "d": d, "r": r}
        for j, (alpha, d, r) in enumerate(frames)
    ]
    return ExperimentFile.model_validate(
        {
            "format": 1,
            "name": "six joints",
            "robot": {
                "gravity": [0.0, 0.0, -9.81],
                "joints": joints,
                "drive_gain_matrix": gain.tolist(),
            },
            "payloads": [{"name": "none", "mass": 0.0}],
            "sessions": [{"file": "s0.csv", "payload": "none"}],
        }
    )


def measured_torque(geometry: Geometry, q, dq, ddq):
    """(N, 6) N m by Pinocchio, with friction written out here."""
    model = pinocchio_model(geometry)
    for joint, mass in enumerate(MASSES):
        centre = np.array([0.05, 0.03, 0.04]) if joint != 1 else np.array([0.15, 0.02, 0.03])
        model.inertias[joint + 1] = pin.Inertia(mass, centre, np.diag([0.02, 0.03, 0.025]) * mass)
    data = model.createData()
    rigid = np.array([pin.rnea(model, data, *sample).copy() for sample in zip(q, dq, ddq, strict=True)])
    friction = VISCOUS * dq + DRY * np.sign(dq)
    friction[:, 1] += LOAD_FRICTION * np.abs(rigid[:, 1]) * np.sign(dq[:, 1])
    motor = dq[:, 4] + dq[:, 5]
    shared = ON_MOTOR_6[0] * motor + ON_MOTOR_6[1] * np.sign(motor)
    friction[:, 4] += shared
    friction[:, 5] += shared
    return rigid + ROTORS * ddq + friction


def waves():
    """Time (N,), and positions, velocities and accelerations (N, 6) of sums of sines."""
    time = np.arange(round(SECONDS * RATE)) / RATE
    random = np.random.default_rng(12)
    omega = 2 * np.pi * np.array([0.13, 0.29, 0.53, 0.87])
    amplitude = random.uniform(0.15, 0.4, (6, 4))
    angle = omega * time[:, None, None] + random.uniform(0, 2 * np.pi, (6, 4))
    q = (amplitude * np.sin(angle)).sum(-1)
    dq = (amplitude * omega * np.cos(angle)).sum(-1)
    ddq = (-amplitude * omega**2 * np.sin(angle)).sum(-1)
    return time, q, dq, ddq


@pytest.fixture(scope="module")
def experiment():
    experiment_file = declared()
    time, q, dq, ddq = waves()
    torque = measured_torque(Geometry.from_robot(experiment_file.robot), q, dq, ddq)
    command = torque @ np.linalg.inv(np.array(experiment_file.robot.drive_gain_matrix)).T
    return memory_experiment(experiment_file, RawSamples(time, q, command))


def memory_experiment(experiment_file, samples):
    """An experiment of one session."""
    entry = SessionEntry("s0.csv", Path("memory/s0.csv"), experiment_file.payloads[0], "identification")
    return MemoryExperiment(
        experiment_file.name,
        Path("memory/experiment.yaml"),
        experiment_file.robot,
        (entry,),
        experiment_file.payloads,
        experiment_file.signals,
        (),
        raw={"s0.csv": samples},
    )


@pytest.fixture(scope="module")
def result(experiment):
    return identify(experiment, "usual", ["coupled-friction@j6", "load-friction@j2"])


def by_pinocchio(file: Path, gravity):
    model = pin.buildModelFromUrdf(str(file))
    model.gravity.linear = np.asarray(gravity)
    data = model.createData()

    def torque(q, dq, ddq):
        places = np.stack([np.cos(q), np.sin(q)], axis=2).reshape(len(q), -1)  # continuous joints
        rows = zip(places, dq, ddq, strict=True)
        rigid = np.array([pin.rnea(model, data, *row).copy() for row in rows])
        return rigid + model.damping * dq + model.friction * np.sign(dq)

    return torque


def by_mujoco(file: Path, gravity):
    model = mujoco.MjModel.from_xml_path(str(file))
    dry = model.dof_frictionloss.copy()
    model.dof_frictionloss[:] = 0.0  # a soft constraint, which takes a speed to be itself
    # of the motor that turns with j5 and j6
    tendon_dry = model.tendon_frictionloss.copy()
    model.tendon_frictionloss[:] = 0.0
    data = mujoco.MjData(model)

    def torque(q, dq, ddq):
        motor = np.sign(dq[:, 4:].sum(axis=1, keepdims=True)) * tendon_dry * [0, 0, 0, 0, 1, 1]
        found = []
        for row in zip(q, dq, ddq, strict=True):
            data.qpos[:], data.qvel[:], data.qacc[:] = row
            mujoco.mj_inverse(model, data)
            found.append(data.qfrc_inverse.copy())
        return np.array(found) + dry * np.sign(dq) + motor - model.actuator_biasprm[:, 0]

    return torque


def by_python(file: Path, gravity):
    spec = importlib.util.spec_from_file_location("six_joints", file)
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return lambda q, dq, ddq: module.torque(q.T, dq.T, ddq.T).T


@pytest.mark.parametrize(
    ("ending", "opened"), [("urdf", by_pinocchio), ("xml", by_mujoco), ("py", by_python)]
)
def test_the_certificate_s_figures_are_those_of_the_program_that_opens_the_file(
    result, tmp_path, ending, opened
):
    file = tmp_path / f"arm.{ending}"
    certificate = write_export(result, file)
    torque = opened(file, result.fitted.record.body.base.geometry.gravity)
    record = result.fitted.record
    (entry,) = result.fitted.entries
    samples, done = record.samples[entry.file], 0
    off, size = np.zeros(6), np.zeros(6)
    for context in contexts(record, entry, None):
        block = context.block
        rows = slice(done, done + block.count)
        found = block.decimate(torque(block.q, block.dq, block.ddq))
        moving = samples.moving[rows]
        off += ((samples.measured[rows] - found) ** 2 * moving).sum(axis=0)
        size += (samples.measured[rows] ** 2 * moving).sum(axis=0)
        done += block.count
    figures = [joint.relative_error_export for joint in certificate.joints]
    assert figures == pytest.approx(np.sqrt(off / size), rel=1e-6)
    for joint in certificate.joints[4:]:
        assert "coupled-friction" in (joint.approximated if ending == "urdf" else joint.kept)
    assert "load-friction" in (
        certificate.joints[1].kept if ending == "py" else certificate.joints[1].approximated
    )


def standard_parameters(model):
    """(11 n,) of the bodies as MuJoCo holds them: principal axes about the centre of mass, and armature."""
    links = []
    for body, rotor in zip(range(1, model.nbody), model.dof_armature, strict=True):
        turn = from_quaternion(model.body_iquat[body])
        inertia = turn @ np.diag(model.body_inertia[body]) @ turn.T
        links.append(
            np.append(parameters_of(Body(model.body_mass[body], model.body_ipos[body], inertia)), rotor)
        )
    return np.concatenate(links)


def test_bodies_that_can_have_the_identified_base_parameters_keep_them_to_1e_9(result, tmp_path):
    certificate = write_export(result, tmp_path / "arm.xml")
    base, chi = result.fitted.record.body.base, result.fitted.fit.chi
    again = standard_parameters(mujoco.MjModel.from_xml_path(str(tmp_path / "arm.xml")))
    off = np.abs(base.from_standard(again) - chi[: len(base)]).max() / np.abs(chi[: len(base)]).max()
    assert all(RIGID in joint.kept for joint in certificate.joints)
    assert off <= 1e-9


def at_power_sign_changes(result, count=24):
    """Motion whose load passes through zero: states beside it, by a few parts in a thousand of the load's size."""
    random = np.random.default_rng(3)
    rigid = module_of(exported_model(result)).rigid_torque
    q, dq, ddq = (random.uniform(-1, 1, (count, 6)) * size for size in (0.8, 1.0, 3.0))
    for row in range(count):
        joint, unit = row % 6, np.eye(6)[row % 6]
        without = ddq[row] * (1 - unit)
        size = rigid(q[row], dq[row], without)[joint]
        slope = rigid(q[row], dq[row], without + unit)[joint] - size
        ddq[row] = without - unit * size / slope * (
            1 + random.choice([-1, 1]) * 10.0 ** random.uniform(-6, -2)
        )
    bare = result.experiment.payloads[0]
    return Motion(np.arange(count) * 0.1, q, dq, ddq, None, bare)


@pytest.mark.parametrize(("name", "add"), [("load-velocity", ()), ("usual", ("load-friction-asymmetric",))])
def test_beside_a_change_of_the_power_sign_every_target_has_the_quadrant_of_the_model(
    experiment, tmp_path, name, add
):
    """The power sign is that of the model's own load, in the fit, its predictions, a simulation and every export."""
    result = identify(experiment, name, add)
    fitted = result.fitted if result.structured is None else result.structured.fitted
    assert fitted.load_from is not None
    assert fitted.load_from.chi == pytest.approx(exported_model(result).chi, rel=1e-15)
    motion = at_power_sign_changes(result)
    exact = of_the_model(result, motion)
    for ending, torque_of in _targets(exported_model(result), tmp_path).items():
        assert torque_of(motion) == pytest.approx(exact, rel=1e-9, abs=1e-9), ending


def _targets(model, folder: Path):
    """What the Python module, the compiled C, the structured text and the data give, by ending."""
    source, header = c_code(model, "arm")
    (folder / "arm.c").write_text(source)
    (folder / "arm.h").write_text(header)
    (folder / "arm.st").write_text(structured_text(model, "arm"))
    (folder / "arm.json").write_text(model_document(model).json_text())
    targets = {
        "py": module_torque(module_of(model), model),
        "st": structured_text_torque(folder / "arm.st"),
        "json": document_torque(folder / "arm.json"),
    }
    if (compiler := compiler_here()) is not None:
        targets["c"] = compiled_torque(compiler, folder / "arm.c")
    return targets
