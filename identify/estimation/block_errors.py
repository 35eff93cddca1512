"""Squared errors of an estimate, block by block, from the triangular factors alone."""

import numpy as np
from numpy.typing import NDArray

from identify.estimation.least_squares import spread
from identify.estimation.observation import Observation

Array = NDArray[np.float64]


def block_errors(observation: Observation, chi: Array) -> Array:
    """(blocks, joints, 2): squared norms of residual and of measured torque."""
    errors = np.zeros((len(observation.blocks), len(observation.joint_columns), 2))
    for block, factors in enumerate(observation.factors):
        for joint, factor in enumerate(factors):
            rows = spread(observation, joint, factor)
            residual = rows[:, -2] - rows[:, :-2] @ chi
            errors[block, joint] = residual @ residual, rows[:, -1] @ rows[:, -1]
    return errors


def ratio(residual: float, measured: float) -> float | None:
    """Relative norm from squared norms; None where nothing was measured."""
    return None if not measured > 0 else float(np.sqrt(residual / measured))
