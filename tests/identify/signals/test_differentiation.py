"""Velocity and acceleration from positions, against motion known in closed form."""

import numpy as np
from hypothesis import given, settings
from hypothesis import strategies as st

from identify.signals.differentiation import differentiate

PART = st.floats(0.01, 0.4)


@settings(max_examples=30, deadline=None)
@given(period=st.floats(1e-4, 0.1), part=st.floats(0.02, 0.4), a=st.floats(-3, 3), v=st.floats(-3, 3))
def test_a_parabola_has_its_velocity_and_acceleration(period, part, a, v):
    time = period * np.arange(3001)
    position = (1.0 + v * time + 0.5 * a * time**2)[:, None]
    q, dq, ddq = differentiate(position, period, (part / period,))
    middle = slice(1300, 1700)
    scale = 1 + abs(v) + abs(a) * time[-1]
    np.testing.assert_allclose(dq[middle, 0], (v + a * time)[middle], atol=1e-6 * scale)
    np.testing.assert_allclose(ddq[middle, 0], a, atol=1e-5 * scale / period / 3000)
    smear = np.abs(q[middle] - position[middle]).max()
    assert smear < 1e-6 * (1 + abs(v) * time[-1] + abs(a) * time[-1] ** 2)
