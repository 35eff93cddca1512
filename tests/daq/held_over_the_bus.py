"""What a session sends that holds the RX130L's joint 3 over the bus, its drive in cyclic torque mode."""

import numpy as np

from daq.excitation.excitation_plan import ExcitationPlan
from daq.plan_setpoints import plan_counts
from daq.rig import Rig
from daq.torque_loop import AxisDynamics, TorqueLoop, design
from daq.torque_offset import SentAhead, per_mille

INERTIA, WEIGHT = 31.0, 204.0
"""kg m², N m: of the arm behind the drive"""
BOUND = 1800
"""per mille of the rated torque: 60 % of the current limit"""


def takes_torque_alone(rig: Rig) -> Rig:
    """The rig as one whose drives have no 0x60B2, a brake holding its axes without power."""
    torque = {"feedforward": "cyclic-torque", "held_by": "brake"}
    return rig.model_copy(update={"axes": tuple(axis.model_copy(update=torque) for axis in rig.axes)})


def held_over_the_bus(rig: Rig, plan: ExcitationPlan) -> SentAhead:
    """The loop's torque alone, along a plan."""
    gains = design(AxisDynamics((INERTIA, INERTIA), WEIGHT), rig.cycle)
    assert gains is not None
    scale = np.diag(rig.position_matrix) / np.diag(rig.drive_gain) * per_mille(rig)
    loop = TorqueLoop(
        scale * gains.proportional,
        scale * gains.integral,
        scale * gains.derivative,
        np.array([BOUND]),
        np.array([gains.crossover]),
    )
    counts = np.zeros((len(plan_counts(rig, plan)), 1), np.int16)
    return SentAhead(counts, np.array([np.inf]), np.full(counts.shape, np.nan), loop)
