"""Observations made of given matrices, without a robot: what least squares and its statistics work on."""

from __future__ import annotations

import numpy as np

from identify.estimation.observation import Observation, TimeBlock
from identify.estimation.triangular_factor import TriangularFactor


def observation_of(joint_rows, joint_columns, width, blocks=10, sessions=1):
    """An observation of all-inertial columns.

    joint_rows    : for each joint (samples, own columns + 1), the last column Y (and tau alike)
    joint_columns : for each joint the global indices of its columns
    """
    cut = [np.array_split(np.column_stack([rows, rows[:, -1]]), blocks) for rows in joint_rows]
    factors = [[TriangularFactor.of(parts[block]) for parts in cut] for block in range(blocks)]
    per_session = blocks // sessions
    return Observation(
        entries=[None] * sessions,
        base=width,
        slots=[],
        slot_columns=[],
        joint_columns=[np.asarray(columns, np.intp) for columns in joint_columns],
        blocks=[
            TimeBlock(min(block // per_session, sessions - 1), float(block), float(block + 1))
            for block in range(blocks)
        ],
        factors=factors,
    )


def single(W, Y, blocks=10, sessions=1):
    """One joint, Y = W chi + rho."""
    return observation_of([np.column_stack([W, Y])], [np.arange(W.shape[1])], W.shape[1], blocks, sessions)
