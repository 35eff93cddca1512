"""One joint that has an inertia alone, and a record of it, for what drives a simulation."""

from __future__ import annotations

from types import SimpleNamespace

import numpy as np

from identify.simulation.measured_motion import MeasuredMotion
from identify.simulation.torque_model import TorqueModel

INERTIA = 3.0
"""kg m²"""


class Body(TorqueModel):
    """The joint; its command is recorded `lead` s after it acts, or acts late where that is below 0."""

    def __init__(self, lead=0.0):
        self.gives, self.joints, self.linear, self.stateful, self.meets = {}, 1, True, [], False
        self.command_lead = [(0, lead)] if lead else []
        experiment = SimpleNamespace(drive_gain=np.eye(1))
        self.fitted = SimpleNamespace(record=SimpleNamespace(experiment=experiment))

    def torque_and_load(self, windows, acceleration):
        return INERTIA * acceleration, INERTIA * acceleration


def recorded(period, rows, torque, extra=None):
    """A measured motion with a constant torque, whose positions no simulation leaves."""
    column = np.zeros((rows, 1))
    return MeasuredMotion(
        period=period,
        time=period * np.arange(rows),
        q=np.linspace(0.0, 9.0, rows)[:, None],
        dq=column,
        ddq=column,
        direction=column,
        torque=column + torque,
        command=column,
        external=None,
        temperature=None,
        resting=np.zeros((rows, 1), bool),
        recorded=column,
        extra=extra or {},
    )
