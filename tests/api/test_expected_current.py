"""The current that a model predicts along a plan: its torque through the drive gain, in the plan's own cycles."""

import numpy as np
import pytest

from api.plan_model import Identified, RegressorModel
from api.service.expected_current import ExpectedCurrent
from daq.excitation import standard_plan
from daq.rig import Rig

TABLE_1 = {"ZZ1R": 30.921, "MX1": 21.109, "MY1": 0.4, "FC1": 39.89, "FV1": 29.429, "offset1": 9.931}


@pytest.fixture(scope="module")
def expected() -> ExpectedCurrent:
    rig = Rig.load("rx130l-joint3-simulated")
    payload = rig.payload("disk-7")
    model = RegressorModel(rig, "usual", [payload], identified=Identified(TABLE_1, "Table I"))
    return ExpectedCurrent(rig, standard_plan(rig, 20.0), payload, model)


def test_the_current_is_the_torque_of_equation_34_over_the_drive_gain(expected):
    cycles = np.linspace(100.0, 5000.0, 50)
    q, dq, ddq = (each[:, 0] for each in expected.plan.setpoints(cycles * expected.rig.cycle))
    g, mass, length = 9.81, 6.97, 1.277
    load = 30.921 * ddq + 21.109 * g * np.cos(q) - 0.4 * g * np.sin(q)
    load += mass * length * (length * ddq + g * np.cos(q))
    torque = load + 39.89 * np.sign(dq) + 29.429 * dq + 9.931
    np.testing.assert_allclose(expected.at(cycles)[:, 0], torque / expected.rig.drive_gain[0, 0], atol=1e-9)


def test_beyond_the_plan_its_end_is_held(expected):
    end = expected.plan.duration / expected.rig.cycle
    np.testing.assert_allclose(expected.at(np.array([end, end + 500.0]))[0], expected.at(np.array([end]))[0])
