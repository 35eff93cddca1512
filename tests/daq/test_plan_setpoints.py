"""A plan as counts of the drives."""

import numpy as np
import pytest

from daq.excitation.excitation_plan import ExcitationPlan
from daq.excitation.trapezoid import Dwell, Move
from daq.plan_setpoints import approach_counts, plan_counts
from daq.rig import Rig
from identify.recording.errors import InputError

RIG = Rig.load("rx130l-joint3-simulated")
PLAN = ExcitationPlan(
    name="there",
    rig=RIG.name,
    joints=("j3",),
    start=(0.1,),
    phases=(Dwell(duration=0.5), Move(to=(0.6,), duration=2.0, ramp=0.4)),
)
COUNTS_PER_RADIAN = 131072 * 95.0 / (2 * np.pi)


def test_there_is_one_row_for_each_cycle_from_begin_to_end():
    counts = plan_counts(RIG, PLAN)
    assert counts.shape == (round(2.5 / RIG.cycle) + 1, 1)
    assert counts.dtype == np.int32
    np.testing.assert_allclose(counts[[0, -1], 0], np.array([0.1, 0.6]) * COUNTS_PER_RADIAN, atol=1.0)


def test_counts_read_back_are_the_plan_s_positions_to_half_a_count():
    counts = plan_counts(RIG, PLAN)
    back = counts @ RIG.position_matrix.T + RIG.position_offset
    wanted = PLAN.setpoints(np.arange(len(counts)) * RIG.cycle).position
    assert np.abs(back - wanted).max() <= 0.5001 / COUNTS_PER_RADIAN


def test_no_approach_is_needed_where_the_plan_begins():
    assert approach_counts(RIG, np.array([0.1]), np.array([0.1])).shape == (0, 1)
    assert len(approach_counts(RIG, np.array([0.0]), np.array([0.1]))) > 10


def test_more_counts_than_an_encoder_holds_are_refused():
    far = PLAN.model_copy(update={"phases": (Move(to=(2000.0,), duration=20000.0, ramp=0.4),)})
    slow = RIG.model_copy(update={"cycle": 100.0})
    with pytest.raises(InputError, match="more counts than an encoder's 32 bits hold"):
        plan_counts(slow, far)
