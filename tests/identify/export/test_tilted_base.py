"""A base that is not level: exact in formats that compute, gravity itself in formats with bodies."""

from __future__ import annotations

import mujoco
import numpy as np
import pinocchio as pin
import pytest

from identify.export.exported_model import exported_model
from identify.export.record_error import Motion
from identify.export.tilted_base import tilted_base
from identify.export.write import write_export
from identify.identification import identify
from tests.identify.export.derivatives import along_the_record, in_formats, with_values
from tests.identify.export.identified_torque import of_the_model
from tests.identify.export.recorded_machine import LINK, recorded_machine

G = 9.81
TILT = np.array([0.7, -0.4])
"""m/s² along the two directions across gravity"""

UPRIGHT, LYING, ACROSS, SLIDE = (
    {"type": "revolute", "alpha": 0.0},
    {"type": "revolute", "alpha": np.pi / 2},
    {"type": "revolute", "alpha": -np.pi / 2, "d": 0.3},
    {"type": "prismatic", "alpha": np.pi / 2},
)


def simulated(frames):
    """A robot with a session without and one with a payload."""
    joints = [{"name": f"j{j + 1}", "d": 0.1, "r": 0.05, **frame} for j, frame in enumerate(frames)]
    gain = 20.0 * np.eye(len(joints))
    return recorded_machine("tilted", joints, gain, seconds=5.0, swing=0.4, seed=8)


def tilted(frames, *beside):
    """An identification with a tilt of `TILT` and no offset, whatever the record holds."""
    result = identify(simulated(frames), "usual", ["gravity-tilt", *beside], payloads=["none"])
    return with_values(result, {"gravity-tilt": TILT, "offset": [0.0]}, {})


def held_out(result, payload):
    random = np.random.default_rng(4)
    n = len(result.fitted.record.joint_names)
    q = np.cumsum(random.uniform(-0.05, 0.05, (30, n)), axis=0)
    dq, ddq = random.uniform(-1, 1, (30, n)), random.uniform(-3, 3, (30, n))
    return Motion(np.linspace(0, 6, 30), q, dq, ddq, None, result.experiment.payloads[payload])


@pytest.mark.parametrize("payload", [0, 1])
@pytest.mark.parametrize(
    ("frames", "beside"),
    [
        ([LYING], ()),
        ([UPRIGHT, LYING, ACROSS], ("presliding@j2", "gain-saturation@j3", "offset")),
        ([SLIDE, LYING, SLIDE], ()),
    ],
)
def test_every_computing_format_is_the_model_on_held_out_motion(frames, beside, payload, tmp_path):
    result = tilted(frames, *beside)
    model = exported_model(result)
    assert model.lost == ()
    motion = held_out(result, payload)
    expected = of_the_model(result, motion)
    without = of_the_model(with_values(result, {"gravity-tilt": np.zeros(2)}, {}), motion)
    assert np.abs(expected - without).max() > 0.04
    for name, torque_of in in_formats(model, tmp_path).items():
        assert torque_of(motion) == pytest.approx(expected, rel=1e-9, abs=1e-9), name


def by_mujoco(file, gravity):
    model = mujoco.MjModel.from_xml_path(str(file))
    assert model.opt.gravity == pytest.approx(gravity, rel=1e-12, abs=1e-12)
    dry = model.dof_frictionloss.copy()
    model.dof_frictionloss[:] = 0.0
    data = mujoco.MjData(model)

    def torque(q, dq, ddq):
        data.qpos[:], data.qvel[:], data.qacc[:] = q, dq, ddq
        mujoco.mj_inverse(model, data)
        return data.qfrc_inverse + dry * np.sign(dq)

    return torque


def by_pinocchio(file, gravity):
    """As the certificate's remark says: gravity is set by the user."""
    model = pin.buildModelFromUrdf(str(file))
    model.gravity.linear = np.array(gravity)
    data = model.createData()
    turns = [joint.nq == 2 for joint in list(model.joints)[1:]]

    def torque(q, dq, ddq):
        places = [
            value
            for each, turn in zip(q, turns, strict=True)
            for value in ([np.cos(each), np.sin(each)] if turn else [each])
        ]
        return (
            pin.rnea(model, data, np.array(places), dq, ddq)
            + model.damping * dq
            + model.friction * np.sign(dq)
        )

    return torque


@pytest.mark.parametrize(
    ("ending", "opened", "frames"),
    [
        ("urdf", by_pinocchio, [LYING]),
        ("urdf", by_pinocchio, [UPRIGHT]),
        ("xml", by_mujoco, [UPRIGHT]),
        ("xml", by_mujoco, [LYING, LYING, ACROSS]),
        ("xml", by_mujoco, [LYING, SLIDE]),
    ],
)
def test_gravity_of_the_file_is_tilted_and_its_torque_is_the_model_s(ending, opened, frames, tmp_path):
    result = tilted(frames)
    certificate = write_export(result, tmp_path / f"arm.{ending}")
    gravity = (
        np.array([0.0, 0.0, -G]) + TILT[0] * np.array([0.0, -1.0, 0.0]) + TILT[1] * np.array([-1.0, 0.0, 0.0])
    )
    torque = opened(tmp_path / f"arm.{ending}", gravity)
    motion = held_out(result, 0)
    expected = of_the_model(result, motion)
    found = np.array([torque(*row) for row in zip(motion.q, motion.dq, motion.ddq, strict=True)])
    assert found == pytest.approx(expected, rel=1e-6, abs=1e-6)
    assert all("gravity-tilt" in joint.kept for joint in certificate.joints)
    assert any("the base is not level" in remark for remark in certificate.remarks)


def test_an_upright_first_joint_of_an_arm_is_approximated_and_measured(tmp_path):
    """The model's torque on it is a wave of its own position; a file's gravity pulls on the links behind it too."""
    certificate = write_export(tilted([UPRIGHT, LYING, ACROSS]), tmp_path / "arm.xml")
    first, *others = certificate.joints
    assert "gravity-tilt" in first.approximated
    assert all("gravity-tilt" in joint.kept for joint in others)
    assert first.relative_difference > 1e-3
    assert any(remark.startswith("j1: the torque of the base's tilt") for remark in certificate.remarks)


def test_the_centre_of_an_upright_first_link_leaves_the_least_of_what_was_identified():
    """On a machine of its true model the tilt is there; any other centre of the first link leaves more."""
    result = tilted([UPRIGHT, LYING, ACROSS])
    model, motions = exported_model(result), [held_out(result, 0)]
    standard = np.array(LINK * 3)
    found = tilted_base(model, standard, True, motions)
    for change in ([0.1, 0.0], [-0.1, 0.0], [0.0, 0.1], [0.0, -0.1]):
        bodies = found.standard.copy()
        bodies[6:8] += change
        assert tilted_base(model, bodies, False, motions).left[0] > found.left[0]
    own = found.standard[:10]
    second = 0.5 * (own[0] + own[3] + own[5]) * np.eye(3) - np.diag(own[[0, 3, 5]])
    pseudo = np.block([[second, own[6:9, None]], [own[None, 6:9], own[9:]]])
    assert np.linalg.eigvalsh(pseudo).min() > 0.0
    assert own[5] == standard[5]


def test_a_tilt_that_no_gravity_makes_is_lost_and_gravity_stays_as_declared(tmp_path):
    """On level slides the model's tilt is a constant force, whatever their mass."""
    certificate = write_export(tilted([SLIDE, LYING, SLIDE]), tmp_path / "arm.xml")
    assert all("gravity-tilt" in joint.lost for joint in certificate.joints)
    assert mujoco.MjModel.from_xml_path(str(tmp_path / "arm.xml")).opt.gravity == pytest.approx(
        [0.0, 0.0, -G]
    )
    assert any("left as declared" in remark for remark in certificate.remarks)


def test_a_payload_is_under_the_file_s_gravity_too(tmp_path):
    """The figure of sessions with a payload is rounding where all is kept but an offset of nothing."""
    result = with_values(
        identify(simulated([LYING]), "usual", ["gravity-tilt"]), {"gravity-tilt": TILT, "offset": [0.0]}, {}
    )
    (joint,) = write_export(result, tmp_path / "arm.xml").joints
    assert "gravity-tilt" in joint.kept
    assert joint.relative_difference < 1e-9


def test_a_tilt_beside_derivatives_over_time_is_the_model_on_a_session_that_was_not_fitted(tmp_path):
    """Slopes of the load and directions of gravity are passes of the same recursion."""
    result = tilted([UPRIGHT, LYING, ACROSS], "elasticity@j2", "backlash@j3", "delay@j2")
    values = {"elasticity": (2e-4, 3e-4), "backlash": (2e-3, -3e-3), "delay": (1e-3,)}
    result = with_values(result, values, {"backlash": {"flank_load": 2.0, "rotor_inertia": 0.1}})
    model = exported_model(result)
    assert model.latency == 3
    motion, torque, alike = along_the_record(result, "s1.csv")
    judged = np.convolve(~alike, np.ones(7), "same") == 0
    judged[-4:] = False
    assert judged.sum() > 0.5 * len(judged)
    for name, torque_of in in_formats(model, tmp_path).items():
        given = torque_of(motion)
        assert given[judged] == pytest.approx(torque[judged], rel=1e-9, abs=1e-9), name
