"""The belts are themselves checked, with numpy alone: what they take from the joints is what they lose and store."""

from __future__ import annotations

import numpy as np
import pytest

from tests.plants.shared_belts import Belt


@pytest.mark.parametrize("side", [1, -1])
def test_the_power_of_a_belt_at_its_joints_is_its_loss_and_the_change_of_its_energy(side):
    time = np.arange(0.0, 2.0, 1e-3)
    pulse = np.array([2.0, 3.1, 4.3])
    dq, ddq = np.sin(np.outer(time, pulse)), pulse * np.cos(np.outer(time, pulse))
    torques = Belt(own=2, side=side, viscous=0.7, dry=1.3, inertia=0.4).torques(dq, ddq)
    np.testing.assert_array_equal(torques[:, 0], 0.0)
    w = dq[:, 2] + side * dq[:, 1]
    stored = np.gradient(0.5 * 0.4 * w**2, time, edge_order=2)
    lost = 0.7 * w**2 + 1.3 * np.abs(w)
    np.testing.assert_allclose(np.sum(torques * dq, axis=1), lost + stored, atol=1e-4)
