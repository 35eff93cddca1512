"""The base regressor of a six-joint robot, ours and Pinocchio's, on the same random motion.

    python benchmarks/regressor_versus_pinocchio.py [--samples 45000]

Pinocchio's is a call for each sample (`computeJointTorqueRegressor`, all 60 link parameters); ours is the columns of
the base parameters for all samples at once. Printed is the least CPU time of five runs (Pinocchio: one), and the
largest difference of the torques of a random set of parameters, as a check that both computed the same robot.
"""

from __future__ import annotations

import argparse
import time
from types import SimpleNamespace

import numpy as np
import pinocchio as pin

from identify.dynamics.base_parameters import base_parameters
from identify.dynamics.geometry import Geometry

PINOCCHIO_ORDER = (4, 5, 7, 6, 8, 9, 1, 2, 3, 0)
"""Where XX XY XZ YY YZ ZZ MX MY MZ M stand among Pinocchio's M MX MY MZ XX XY YY XZ YZ ZZ."""

TX40 = (
    (0.0, 0.0, 0.0, 0.32),
    (-np.pi / 2, 0.0, 0.0, 0.0),
    (0.0, 0.225, 0.0, 0.035),
    (np.pi / 2, 0.0, 0.0, 0.225),
    (-np.pi / 2, 0.0, 0.0, 0.0),
    (np.pi / 2, 0.0, np.pi, 0.0),
)
"""alpha, d, theta, r of the Staubli TX40."""


def geometry() -> Geometry:
    """The TX40 as `identify` holds it."""
    keys = ("alpha", "d", "theta", "r")
    joints = [
        SimpleNamespace(name=f"j{k + 1}", type="revolute", **dict(zip(keys, row, strict=True)))
        for k, row in enumerate(TX40)
    ]
    return Geometry.from_robot(SimpleNamespace(gravity=(0.0, 0.0, -9.81), joints=joints))


def pinocchio_model() -> pin.Model:
    """The TX40 in Pinocchio, without inertias."""
    model = pin.Model()
    for k, (alpha, d, theta, r) in enumerate(TX40):
        about_x = pin.SE3(pin.utils.rotate("x", alpha), np.array([d, 0.0, 0.0]))
        about_z = pin.SE3(pin.utils.rotate("z", theta), np.array([0.0, 0.0, r]))
        model.addJoint(k, pin.JointModelRZ(), about_x * about_z, f"j{k + 1}")
    return model


def main() -> None:
    """Measure and print."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--samples", type=int, default=45_000)
    samples = parser.parse_args().samples
    q, dq, ddq = np.random.default_rng(0).normal(size=(3, samples, 6))
    started = time.process_time()
    base = base_parameters(geometry())
    search = time.process_time() - started
    ours = []
    for _ in range(5):
        started = time.process_time()
        columns = base.columns_of_joints(q, dq, ddq)
        ours.append(time.process_time() - started)
    model = pinocchio_model()
    data = model.createData()
    theirs = np.empty((samples, 6, 60))
    started = time.process_time()
    for k in range(samples):
        theirs[k] = pin.computeJointTorqueRegressor(model, data, q[k], dq[k], ddq[k])
    pinocchio = time.process_time() - started

    standard = np.zeros((6, 11))
    standard[:, :10] = np.random.default_rng(1).uniform(0.1, 1.0, (6, 10))
    chi = base.from_standard(standard.ravel())
    torque = np.stack([part @ chi[base.acts_on(k)] for k, part in enumerate(columns)], axis=-1)
    order = [10 * link + place for link in range(6) for place in PINOCCHIO_ORDER]
    reference = theirs[:, :, order] @ standard[:, :10].ravel()
    difference = np.abs(torque - reference).max() / np.abs(reference).max()

    held = sum(part.nbytes for part in columns)
    print(f"{samples} samples, six joints, {len(base)} base parameters (found in {search * 1e3:.0f} ms)")
    print(f"{'':18}{'ours':>10}{'Pinocchio':>12}{'ratio':>8}")
    print(f"{'CPU time, s':18}{min(ours):10.3f}{pinocchio:12.3f}{pinocchio / min(ours):8.1f}")
    print(f"{'columns held, MB':18}{held / 1e6:10.1f}{theirs.nbytes / 1e6:12.1f}{theirs.nbytes / held:8.1f}")
    print(f"largest relative difference of the torques: {difference:.1e}")


if __name__ == "__main__":
    main()
