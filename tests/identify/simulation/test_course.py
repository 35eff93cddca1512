"""Windows simulated from given states, against the closed form of a body that a constant torque drives."""

from __future__ import annotations

from types import SimpleNamespace

import numpy as np
import pytest

from identify.simulation.course import State, simulate_from
from identify.simulation.measured_motion import MeasuredMotion
from identify.simulation.torque_model import TorqueModel, Windows

INERTIA, PERIOD, ROWS = 3.0, 4e-3, 60


class Body(TorqueModel):
    """One joint with an inertia alone."""

    def __init__(self):
        self.gives, self.joints, self.linear, self.stateful, self.meets = {}, 1, True, [], False
        self.command_lead = []
        self.fitted = SimpleNamespace(record=SimpleNamespace(experiment=None))

    def torque_and_load(self, windows, acceleration):
        return INERTIA * acceleration, INERTIA * acceleration


def test_a_torque_beside_the_recorded_one_drives_each_window_by_itself():
    column = np.zeros((ROWS, 1))
    motion = MeasuredMotion(
        period=PERIOD,
        time=PERIOD * np.arange(ROWS),
        q=np.linspace(0.0, 9.0, ROWS)[:, None],
        dq=column,
        ddq=column,
        direction=column,
        torque=column + 6.0,
        command=column,
        external=None,
        temperature=None,
        resting=np.zeros((ROWS, 1), bool),
        recorded=column,
        extra={},
    )
    first, speed = np.array([0, 5]), np.array([[0.5], [1.0]])
    windows = Windows(motion.time[first], np.zeros((2, 1)), speed, np.sign(speed))
    state = State(windows, np.zeros((2, 1)), np.zeros((2, 1)))
    beside = np.array([[0.0], [3.0]])
    course = simulate_from(Body(), motion, first, 41, state, beside=beside)
    time = PERIOD * np.arange(41)[:, None]
    expected = speed.T * time + 0.5 * (6.0 + beside.T) / INERTIA * time**2
    np.testing.assert_allclose(course.q[:, :, 0], expected, atol=1e-12)
    assert course.applied[3, :, 0] == pytest.approx([6.0, 9.0])
    np.testing.assert_allclose(course.end.windows.q, course.q[-1])
