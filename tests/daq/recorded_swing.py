"""Rows of a swing, as a drive would answer it."""

import numpy as np

from daq.rig import Rig
from daq.samples import COMMAND_CAME, POSITION_CAME, Phase, sample_dtype

WHOLE = POSITION_CAME | COMMAND_CAME


def recorded_swing(rig: Rig, seconds: float = 8.0) -> np.ndarray:
    """Rows of `sample_dtype` while a plan is driven: 0.5 rad at 0.3 Hz, every answer there."""
    rows = np.zeros(round(seconds / rig.cycle), sample_dtype(1))
    rows["cycle"] = np.arange(len(rows)) + 1000
    time = rows["cycle"] * rig.cycle
    position = 0.5 * np.sin(2 * np.pi * 0.3 * time) / rig.position_matrix[0, 0]
    rows["position"][:, 0] = rows["setpoint"][:, 0] = np.rint(position)
    rows["command"][:, 0] = np.rint(500 * np.sin(2 * np.pi * 0.3 * time) + 20 * np.sin(40 * time))
    rows["phase"], rows["valid"] = Phase.PLAN, WHOLE
    return rows
