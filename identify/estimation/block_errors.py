"""Squared errors of an estimate, block by block, from the triangular factors alone."""

import numpy as np
from numpy.typing import NDArray

from identify.estimation.observation import Observation

Array = NDArray[np.float64]


def block_errors(observation: Observation, chi: Array) -> Array:
    """(blocks, joints, 2): squared norms of residual and of measured torque."""
    errors = np.zeros((len(observation.blocks), len(observation.joint_columns), 2))
    for joint, columns in enumerate(observation.joint_columns):
        stacked = observation.stacked(joint)
        residual = stacked.rows[:, -2] - stacked.rows[:, :-2] @ chi[columns]
        errors[:, joint] = stacked.sums(np.column_stack([residual, stacked.rows[:, -1]]) ** 2)
    return errors


def ratio(residual: float, measured: float) -> float | None:
    """Relative norm from squared norms; None where nothing was measured."""
    return None if not measured > 0 else float(np.sqrt(residual / measured))
