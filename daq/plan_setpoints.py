"""A plan as the drives receive it: counts of every axis, one row per SYNC cycle."""

import numpy as np
from numpy.typing import NDArray

from daq.excitation.excitation_plan import ExcitationPlan
from daq.excitation.standard_plan import approach
from daq.rig import Rig
from identify.recording.errors import InputError


def plan_counts(rig: Rig, plan: ExcitationPlan) -> NDArray[np.int32]:
    """(L, n) targets of a plan, one per cycle from its begin to its end.

    Raises InputError where a position lies beyond what the drives can count.
    """
    cycles = int(np.floor(plan.duration / rig.cycle)) + 1
    position = plan.setpoints(np.arange(cycles, dtype=np.float64) * rig.cycle).position
    return _counts(rig, position)


def approach_counts(rig: Rig, here: NDArray[np.float64], to: NDArray[np.float64]) -> NDArray[np.int32]:
    """(L, n) targets of a slow move from where the joints are to where a plan begins; possibly none."""
    way = approach(rig, here, to, rig.supervision.approach_speed)
    if way is None:
        return np.empty((0, len(rig.axes)), np.int32)
    return plan_counts(rig, way)


def _counts(rig: Rig, position: NDArray[np.float64]) -> NDArray[np.int32]:
    counts = np.rint(np.linalg.solve(rig.position_matrix, (position - rig.position_offset).T).T)
    if np.abs(counts).max(initial=0.0) > 2**31 - 1:
        raise InputError(f"rig {rig.name}: the plan asks for more counts than an encoder's 32 bits hold")
    return counts.astype(np.int32)
