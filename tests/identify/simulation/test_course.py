"""Windows simulated from given states, against the closed form of a body that a constant torque drives."""

from __future__ import annotations

import numpy as np
import pytest

from identify.simulation.course import State, simulate_from
from identify.simulation.torque_model import Windows
from tests.identify.simulation.one_body import INERTIA, Body, recorded

PERIOD, ROWS = 4e-3, 60


def test_a_torque_beside_the_recorded_one_drives_each_window_by_itself():
    motion = recorded(PERIOD, ROWS, 6.0)
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
