"""What a planned motion tells before anything moves."""

import numpy as np
import pytest

from api.planned_motion import determination
from daq.excitation.standard_plan import standard_plan


@pytest.fixture(scope="module")
def motion(rig):
    plan = standard_plan(rig, 60.0)
    return plan, *plan.setpoints(np.linspace(0.0, plan.duration, 3000))


def test_a_standard_plan_determines_the_usual_model_and_a_joint_at_rest_nothing(rig, motion):
    _plan, q, dq, ddq = motion
    found = determination(rig, q, dq, ddq)
    assert found.weak == ()
    assert 1.0 < found.condition < 100.0
    still = determination(rig, np.zeros_like(q), np.zeros_like(q), np.zeros_like(q))
    assert {"FV", "FC"} <= set(still.weak)
