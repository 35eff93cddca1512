"""Robots for the tests of dynamics: random ones, textbook ones, and Pinocchio's idea of each."""

from __future__ import annotations

from types import SimpleNamespace

import numpy as np
import pinocchio as pin
from hypothesis import strategies as st

from identify.dynamics.geometry import Geometry

PINOCCHIO_ORDER = ("M", "MX", "MY", "MZ", "XX", "XY", "YY", "XZ", "YZ", "ZZ")


def robot(gravity, joints):
    """A robot as `identify.recording` hands it over: joints as (type, alpha, d, theta, r)."""
    keys = ("type", "alpha", "d", "theta", "r")
    return SimpleNamespace(
        gravity=gravity,
        joints=[
            SimpleNamespace(name=f"joint{k + 1}", motor_ratio=1.0, **dict(zip(keys, values, strict=True)))
            for k, values in enumerate(joints)
        ],
    )


def joint_placement(geometry: Geometry, j: int) -> pin.SE3:
    """Frame j in frame j-1 with the joint at zero, from Pinocchio's own rotations."""
    about_x = pin.SE3(pin.utils.rotate("x", geometry.alpha[j]), np.array([geometry.d[j], 0.0, 0.0]))
    about_z = pin.SE3(pin.utils.rotate("z", geometry.theta[j]), np.array([0.0, 0.0, geometry.r[j]]))
    return about_x * about_z


def pinocchio_model(geometry: Geometry) -> pin.Model:
    """The same robot in Pinocchio, without inertias."""
    model = pin.Model()
    model.gravity.linear = np.asarray(geometry.gravity)
    for j in range(geometry.joint_count):
        kind = pin.JointModelPZ() if geometry.prismatic[j] else pin.JointModelRZ()
        model.addJoint(j, kind, joint_placement(geometry, j), f"joint{j}")
    return model


def pinocchio_regressor(geometry: Geometry, q, dq, ddq):
    """(N, n, 10 n) torque regressor by Pinocchio, its columns put in the paper's order."""
    model = pinocchio_model(geometry)
    data = model.createData()
    ours = ("XX", "XY", "XZ", "YY", "YZ", "ZZ", "MX", "MY", "MZ", "M")
    order = [
        10 * link + PINOCCHIO_ORDER.index(symbol) for link in range(geometry.joint_count) for symbol in ours
    ]
    samples = zip(q, dq, ddq, strict=True)
    regressors = [np.atleast_2d(pin.computeJointTorqueRegressor(model, data, *sample)) for sample in samples]
    return np.array(regressors)[:, :, order]


def link_columns(regressor):
    """The (N, n, 11 n) regressor without the columns of Ia."""
    return np.delete(regressor, np.arange(10, regressor.shape[-1], 11), axis=-1)


def random_motion(seed, samples, joints):
    generator = np.random.default_rng(seed)
    return (
        generator.uniform(-np.pi, np.pi, (samples, joints)),
        generator.uniform(-3, 3, (samples, joints)),
        generator.uniform(-10, 10, (samples, joints)),
    )


right_angles = st.sampled_from([0.0, np.pi / 2, -np.pi / 2, np.pi])
angles = st.one_of(right_angles, st.floats(-3.1, 3.1))
lengths = st.one_of(st.just(0.0), st.floats(0.05, 1.0), st.floats(-1.0, -0.05))
joints = st.tuples(st.sampled_from(["revolute", "prismatic"]), angles, lengths, angles, lengths)
gravities = st.sampled_from(
    [(0.0, 0.0, -9.81), (0.0, -9.81, 0.0), (9.81, 0.0, 0.0), (0.0, 0.0, 0.0), (1.0, -2.0, -9.5)]
)
robots = st.builds(robot, gravities, st.lists(joints, min_size=1, max_size=7))


def geometry_of(gravity, joints) -> Geometry:
    return Geometry.from_robot(robot(gravity, joints))
