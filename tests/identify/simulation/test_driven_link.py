"""Links behind motors whose motion is known, against closed forms."""

from __future__ import annotations

import numpy as np
import pytest

from identify.effects.give import Give
from identify.simulation.driven_link import DrivenLink, link_lags


def test_a_link_on_a_spring_follows_the_closed_form_of_an_oscillator_that_is_driven():
    """J x'' + d x' + k x = f cos(w t), begun where it swings with the drive alone."""
    inertia, stiffness, damping, rate, step = 8.0, 2.0e4, 40.0, 30.0, 1e-3
    time = step * np.arange(4000)
    give = Give(4.0, 1.0 / stiffness, relaxation=damping / stiffness)
    whole = np.full((len(time), 1), inertia + give.rotor)
    link = DrivenLink(0, step, np.zeros(len(time)), np.cos(rate * time), np.zeros_like(whole), whole)
    (lag,) = link_lags(give, [link])
    response = 1.0 / (stiffness - inertia * rate**2 + 1j * damping * rate)
    swing = np.real(response * np.exp(1j * rate * time))
    np.testing.assert_allclose(lag.twist[3000:], swing[3000:], atol=0.01 * abs(response))
    carried = np.real((stiffness + 1j * damping * rate) * response * np.exp(1j * rate * time))
    np.testing.assert_allclose(lag.carried[3000:], carried[3000:], atol=0.01)


def test_a_link_in_its_gap_flies_until_the_other_flank_holds_it():
    """A load that turns slowly: J x'' = f while nothing touches."""
    step, inertia, ramp = 1e-3, 8.0, 40.0
    time = step * np.arange(2000)
    give = Give(4.0, gap=4e-3, flank_load=0.01)
    whole = np.full((len(time), 1), inertia + give.rotor)
    load = ramp * (time - 1.0)
    (lag,) = link_lags(give, [DrivenLink(0, step, np.zeros(len(time)), load, np.zeros_like(whole), whole)])
    flying = np.flatnonzero((time > 1.0) & (np.abs(lag.twist) < 0.0019))
    np.testing.assert_allclose(
        lag.twist[flying], -0.002 + ramp * (time[flying] - 1.0) ** 3 / (6 * inertia), atol=1e-4
    )
    assert time[flying[-1]] - 1.0 == pytest.approx((6 * inertia * 0.0039 / ramp) ** (1 / 3), rel=0.03)
    settled = (time < 0.98) | (time > 1.3)
    np.testing.assert_allclose(lag.carried[settled], load[settled], atol=0.1)
