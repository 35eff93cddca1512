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
    link = DrivenLink(
        0, step, np.zeros(len(time)), np.zeros(len(time)), np.cos(rate * time), np.zeros_like(whole), whole
    )
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
    still = np.zeros(len(time))
    (lag,) = link_lags(give, [DrivenLink(0, step, still, still, load, np.zeros_like(whole), whole)])
    flying = np.flatnonzero((time > 1.0) & (np.abs(lag.twist) < 0.0019))
    np.testing.assert_allclose(
        lag.twist[flying], -0.002 + ramp * (time[flying] - 1.0) ** 3 / (6 * inertia), atol=1e-4
    )
    assert time[flying[-1]] - 1.0 == pytest.approx((6 * inertia * 0.0039 / ramp) ** (1 / 3), rel=0.03)
    settled = (time < 0.98) | (time > 1.3)
    np.testing.assert_allclose(lag.carried[settled], load[settled], atol=0.1)


def driven_at(speed, duration, give, load=0.0, step=1e-3):
    """A link behind a motor that goes with a steady speed; 8 kg m² that nothing else drives but a load."""
    time = step * np.arange(round(duration / step))
    still = np.zeros(len(time))
    whole = np.full((len(time), 1), 8.0 + give.rotor)
    going = still + speed
    (lag,) = link_lags(give, [DrivenLink(0, step, going, still, still + load, np.zeros_like(whole), whole)])
    return time, lag


@pytest.mark.parametrize("way", [1.0, -1.0])
def test_a_link_that_rubs_is_carried_along_at_its_flank(way):
    give = Give(4.0, gap=0.01, flank_load=0.1, link_dry=20.0)
    _, lag = driven_at(0.05 * way, 1.0, give)
    np.testing.assert_allclose(lag.carried[300:], way * 20.0, rtol=1e-6)
    np.testing.assert_allclose(lag.friction[300:], way * 20.0, rtol=1e-6)
    np.testing.assert_allclose(lag.twist[300:], way * 0.005, rtol=1e-6)


def test_a_link_that_rubs_rests_in_its_gap_until_its_motor_has_crossed_it():
    """The motor turns round at a steady speed, slowly enough that the link does not fly."""
    step, speed, gap = 1e-3, 0.05, 0.01
    time = step * np.arange(900)
    going = np.where(time < 0.4, speed, -speed)
    still = np.zeros(len(time))
    whole = np.full((len(time), 1), 12.0)
    give = Give(4.0, gap=gap, flank_load=0.1, link_dry=200.0)
    (lag,) = link_lags(give, [DrivenLink(0, step, going, still, still, np.zeros_like(whole), whole)])
    crossing = (time > 0.405) & (time < 0.4 + gap / speed - 0.005)
    expected = 0.5 * gap - speed * (time - 0.4)
    np.testing.assert_allclose(lag.twist[crossing], expected[crossing], atol=1.5 * speed * step)
    assert np.max(np.abs(lag.carried[crossing])) < 0.2
    np.testing.assert_allclose(lag.carried[time > 0.7], -200.0, rtol=1e-6)


def test_a_link_on_a_spring_sticks_until_the_spring_pulls_more_than_friction_holds():
    step, speed, stiffness, dry = 1e-3, 0.02, 2.0e4, 20.0
    give = Give(4.0, 1.0 / stiffness, relaxation=2e-3, link_dry=dry)
    time = step * np.arange(900)
    going = np.where(time < 0.4, speed, -speed)
    still = np.zeros(len(time))
    whole = np.full((len(time), 1), 12.0)
    (lag,) = link_lags(give, [DrivenLink(0, step, going, still, still, np.zeros_like(whole), whole)])
    assert np.mean(lag.carried[275:400]) == pytest.approx(dry, rel=0.05)  # a period of its swing
    winding = (time > 0.41) & (time < 0.4 + 2 * dry / stiffness / speed - 0.01)
    expected = lag.carried[400] - stiffness * speed * (time - 0.4)
    np.testing.assert_allclose(lag.carried[winding], expected[winding], atol=2.0)
    assert np.mean(lag.carried[-125:]) == pytest.approx(-dry, rel=0.05)
