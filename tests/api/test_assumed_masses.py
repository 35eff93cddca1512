"""What is assumed of an arm of which nothing was measured."""

import numpy as np
import pytest

from api.assumed_masses import GRAVITY_SHARE, torque_limits
from api.plan_model import RegressorModel
from daq.excitation import standard_plan
from daq.excitation.plan_model import PlannedMotion


@pytest.fixture(scope="module")
def motion(rig) -> PlannedMotion:
    return PlannedMotion.of(standard_plan(rig, 40.0), rig.payload("disk-7"), 0.02)


def test_what_is_assumed_takes_the_stated_share_of_the_current_and_has_no_values(rig):
    model = RegressorModel(rig, "rigid", rig.payloads)
    still = np.zeros((200, 1))
    q = np.linspace(*rig.axes[0].limits.position, 200)[:, np.newaxis]
    load = model.load(PlannedMotion(rig.payloads[0], np.arange(200.0), q, still, still, 1.0))
    assert np.abs(load).max() == pytest.approx(GRAVITY_SHARE * torque_limits(rig)[0], rel=0.01)
    assert all(parameter.value is None for parameter in model.parameters)
    assert not model.is_identified


def test_before_anything_is_measured_dry_and_viscous_friction_take_their_share_of_the_current(rig):
    """A twentieth each: dry friction at standstill, and both at the highest speed."""
    speed = rig.axes[0].limits.velocity * np.array([1e-9, 1.0, -1.0])[:, np.newaxis]
    still = np.zeros_like(speed)
    motion = PlannedMotion(rig.payloads[0], np.arange(3.0), still, speed, still, 1.0)
    usual, rigid = (
        RegressorModel(rig, name, rig.payloads).torque(motion)[:, 0] for name in ("usual", "rigid")
    )
    share = 0.05 * torque_limits(rig)[0]
    assert usual - rigid == pytest.approx(np.array([share, 2 * share, -2 * share]))
