"""Motors that several joints turn: exact where formulas are, and in MJCF a tendon each. Six joints by Pinocchio, of which two
neighbours share a motor that turns with the sum of theirs, and two others one with a rotor that turns with the difference."""

from __future__ import annotations

from dataclasses import replace

import mujoco
import numpy as np
import pytest

from identify.dynamics.geometry import Geometry
from identify.export.exported_model import Torque, exported_model
from identify.export.record_error import Motion
from identify.export.shared_motors import motors_apart, shared_motor_remarks, turns_of
from identify.export.write import write_export
from identify.identification import identify
from identify.recording.samples import RawSamples
from tests.identify.export.derivatives import in_formats
from tests.identify.export.identified_torque import of_the_model
from tests.identify.export.test_six_coupled_joints import declared, measured_torque, memory_experiment, waves

MOTOR_RATIOS = (1.0, 1.0, 50.0, 40.0, 30.0, 30.0)
DIFFERENCE = np.array([0.0, 0.0, -50.0 / 40.0, 1.0, 0.0, 0.0])
DAMPING, DRY, ROTOR = 1.5, 1.1, 0.35
"""N m s/rad, N m and kg m² of the motor that turns with the difference of j3 and j4"""
SUM, APART = "shared-motor-sum", "shared-motor-difference"
COMPUTING = (".py", ".c", ".st", ".fmu", ".json")


def plant_torque(geometry, q, dq, ddq):
    """(N, 6) N m: that of the six joints, which has the sum of j5 and j6, and the difference written out here."""
    speed, change = dq @ DIFFERENCE, ddq @ DIFFERENCE
    moved = DAMPING * speed + DRY * np.sign(speed) + ROTOR * change
    return measured_torque(geometry, q, dq, ddq) + np.outer(moved, DIFFERENCE)


@pytest.fixture(scope="module")
def experiment():
    described = declared()
    joints = [
        joint.model_copy(update={"motor_ratio": ratio})
        for joint, ratio in zip(described.robot.joints, MOTOR_RATIOS, strict=True)
    ]
    gains = np.diag(np.diag(described.robot.drive_gain_matrix))
    matrix = tuple(tuple(row) for row in gains.tolist())
    robot = described.robot.model_copy(update={"joints": tuple(joints), "drive_gain_matrix": matrix})
    time, q, dq, ddq = waves()
    torque = plant_torque(Geometry.from_robot(robot), q, dq, ddq)
    samples = RawSamples(time, q, torque @ np.linalg.inv(gains))
    return replace(memory_experiment(described, samples), robot=robot)


@pytest.fixture(scope="module")
def result(experiment):
    return identify(experiment, "usual", [f"{SUM}@j6", f"{APART}@j4"])


@pytest.fixture(scope="module")
def motion(experiment):
    """States that the session did not have."""
    random = np.random.default_rng(8)
    q, dq, ddq = (scale * random.uniform(-1, 1, (60, 6)) for scale in (0.9, 1.2, 4.0))
    return Motion(np.linspace(0, 1, 60), q, dq, ddq, None, experiment.payloads[0])


def test_every_computing_format_is_the_model_and_the_machine(result, motion, tmp_path):
    model = exported_model(result)
    assert model.lost == ()
    shown = {(each.effect, each.row): each for each in model.torques}
    for key in ((SUM, 4), (SUM, 5), (APART, 2), (APART, 3)):
        assert key in shown
    assert len(shown[APART, 3].formulas) == 3  # the rotor is one of them
    np.testing.assert_allclose(turns_of(model, shown[APART, 3]), DIFFERENCE)
    exact = of_the_model(result, motion)
    true = plant_torque(model.geometry, motion.q, motion.dq, motion.ddq)
    from_j3 = slice(2, None)  # the second joint's friction over its load is not in the model
    off = np.linalg.norm((exact - true)[:, from_j3], axis=0)
    assert (off < 0.01 * np.linalg.norm(true[:, from_j3], axis=0)).all()
    for name, torque_of in in_formats(model, tmp_path).items():
        assert torque_of(motion) == pytest.approx(exact, rel=1e-9, abs=1e-9), name


@pytest.mark.parametrize("ending", [*COMPUTING, ".xml", ".urdf", ".sdf"])
def test_the_certificate_says_what_becomes_of_them(result, tmp_path, ending):
    certificate = write_export(result, tmp_path / f"arm{ending}")
    shared = {"j3": APART, "j4": APART, "j5": SUM, "j6": SUM}
    said = [remark for remark in certificate.remarks if "a motor that several joints turn" in remark]
    for joint in certificate.joints:
        effect = shared.get(joint.joint)
        held = ending in (*COMPUTING, ".xml")
        assert effect is None or effect in (joint.kept if held else joint.approximated)
        assert not {SUM, APART} & set(joint.lost)
        if held and joint.relative_difference is not None and not joint.lost:
            assert joint.relative_difference < (1e-9 if ending in COMPUTING else 1e-6)
    assert len(said) == (0 if ending in (*COMPUTING, ".xml") else 2)
    assert all("damping and dry friction stand for its friction" in remark for remark in said)


def test_mujoco_moves_as_the_model_says_with_its_tendons(result, motion, tmp_path):
    """Forward: under the torque less dry friction, which is a soft constraint there, the accelerations are the motion's."""
    write_export(result, tmp_path / "arm.xml")
    arm = mujoco.MjModel.from_xml_path(str(tmp_path / "arm.xml"))
    dry, tendon_dry = arm.dof_frictionloss.copy(), arm.tendon_frictionloss.copy()
    arm.dof_frictionloss[:] = 0.0
    arm.tendon_frictionloss[:] = 0.0
    names = [arm.tendon(place).name for place in range(arm.ntendon)]
    turns = {f"{SUM} j6": np.array([0, 0, 0, 0, 1.0, 1.0]), f"{APART} j4": DIFFERENCE}
    assert set(names) == set(turns)
    data = mujoco.MjData(arm)
    exact = of_the_model(result, motion)
    for row in range(10):
        dq = motion.dq[row]
        torque = exact[row] - dry * np.sign(dq)
        for name, size in zip(names, tendon_dry, strict=True):
            torque -= turns[name] * size * np.sign(turns[name] @ dq)
        data.qpos[:], data.qvel[:], data.ctrl[:] = motion.q[row], dq, torque
        mujoco.mj_forward(arm, data)
        assert data.qacc == pytest.approx(motion.ddq[row], rel=1e-5, abs=1e-5)


def test_no_motor_is_written_whose_friction_drives_and_no_rotor_below_zero(result):
    model = exported_model(result)
    formulas = ("motor_share * motor_velocity", "motor_share * (motor_acceleration)")

    def with_values(*values):
        both = [Torque(APART, row, 3, formulas, values, turns=tuple(DIFFERENCE)) for row in (2, 3)]
        return replace(model, torques=tuple(both))

    apart = motors_apart(with_values(2.0, 0.3), "xml")
    (motor,) = apart.motors
    assert (motor.damping, motor.dry, motor.rotor) == (2.0, 0.0, 0.3)
    assert apart.kept == {(APART, 2), (APART, 3)}
    assert apart.rest.torques == ()
    apart = motors_apart(with_values(2.0, -0.3), "xml")
    assert (apart.motors[0].rotor, apart.kept, apart.near) == (0.0, frozenset(), {(APART, 2), (APART, 3)})
    for refused in (motors_apart(with_values(-2.0, 0.3), "xml"), motors_apart(with_values(2.0, 0.3), "sdf")):
        assert refused.motors == ()
        assert len(refused.rest.torques) == 2
        (remark,) = shared_motor_remarks(refused.rest)
        assert remark.startswith(f"{APART}: ")
        assert remark.endswith("does not hold; a rotor's inertia in it is lost")


def test_what_is_more_than_friction_and_a_rotor_is_no_motor_of_a_file(result):
    curved = Torque(APART, 3, 3, ("motor_share * motor_velocity**2",), (1.0,), turns=tuple(DIFFERENCE))
    own = Torque("viscous", 3, 3, ("motor_share * motor_velocity",), (1.0,))
    model = replace(exported_model(result), torques=(curved, own))
    apart = motors_apart(model, "xml")
    assert apart.motors == ()
    assert apart.rest.torques == (curved, own)
    assert shared_motor_remarks(model) == []
