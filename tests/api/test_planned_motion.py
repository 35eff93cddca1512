"""What a planned motion tells before anything moves, against a pendulum worked out by hand."""

import numpy as np
import pytest

from api.planned_motion import determination, predicted_torque
from daq.excitation.standard_plan import standard_plan
from daq.rig import KnownPayload, Rig

GRAVITY = 9.81


@pytest.fixture(scope="module")
def rig():
    return Rig.load("rx130l-joint3-simulated")


@pytest.fixture(scope="module")
def motion(rig):
    plan = standard_plan(rig, 60.0)
    return plan, *plan.setpoints(np.linspace(0.0, plan.duration, 3000))


def test_a_payload_adds_the_torque_of_a_point_mass_to_that_of_the_arm(rig, motion):
    _plan, q, dq, ddq = motion
    from identify.dynamics.base_parameters import base_parameters
    from identify.dynamics.geometry import Geometry

    names = base_parameters(Geometry.from_robot(rig.robot)).names
    identified = dict.fromkeys(names, 0.0) | {"FV1": 2.0, "FC1": 3.0, "offset1": 0.5}
    empty = predicted_torque(rig, KnownPayload(name="none", mass=0.0), identified, q, dq, ddq)
    assert empty is not None
    np.testing.assert_allclose(empty, 2.0 * dq + 3.0 * np.sign(dq) + 0.5, rtol=1e-12)
    mass, length = 3.0, 0.8
    carried = predicted_torque(
        rig, KnownPayload(name="disk", mass=mass, com=(length, 0.0, 0.0)), identified, q, dq, ddq
    )
    assert carried is not None
    weight = (carried - empty)[:, 0] - mass * length**2 * ddq[:, 0]
    # What is left is m g l times the sine or cosine of the angle to the vertical, whichever way the joint is mounted.
    amplitude = np.hypot(
        *np.linalg.lstsq(np.column_stack([np.cos(q[:, 0]), np.sin(q[:, 0])]), weight, rcond=None)[0]
    )
    assert amplitude == pytest.approx(mass * GRAVITY * length, rel=1e-6)


def test_a_model_without_every_base_parameter_predicts_nothing(rig, motion):
    _plan, q, dq, ddq = motion
    assert predicted_torque(rig, KnownPayload(name="none", mass=0.0), {"FV1": 1.0}, q, dq, ddq) is None


def test_a_standard_plan_determines_the_usual_model_and_a_joint_at_rest_nothing(rig, motion):
    _plan, q, dq, ddq = motion
    found = determination(rig, q, dq, ddq)
    assert found.weak == ()
    assert 1.0 < found.condition < 100.0
    still = determination(rig, np.zeros_like(q), np.zeros_like(q), np.zeros_like(q))
    assert {"FV", "FC"} <= set(still.weak)
