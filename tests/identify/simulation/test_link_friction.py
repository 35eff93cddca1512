"""Dry friction of a link over a step, against the closed forms of a body that brakes."""

from __future__ import annotations

import numpy as np
import pytest

from identify.effects.give import Give
from identify.simulation.link_friction import Transmission, link_friction

MASS, STEP = 8.0, 0.01
LIMIT = 20.0


def braked(speed, force):
    """Friction and the speed after a step of one body under a force."""
    going, pushed = np.array([float(speed)]), np.array([float(force)])

    def solved(friction):
        return np.zeros(1), going + STEP * (pushed - friction) / MASS

    _, friction = link_friction(LIMIT, going, solved, lambda: pushed + MASS * going / STEP)
    return friction[0], solved(friction)[1][0]


@pytest.mark.parametrize("way", [1.0, -1.0])
def test_a_body_that_slides_is_braked_by_all_of_it_and_one_at_rest_held_up_to_it(way):
    assert braked(way * 0.5, 5.0)[0] == way * LIMIT
    assert braked(0.0, way * 15.0) == (way * 15.0, 0.0)
    friction, speed = braked(0.0, way * 30.0)
    assert friction == way * LIMIT
    assert speed == pytest.approx(way * STEP * 10.0 / MASS)


@pytest.mark.parametrize("way", [1.0, -1.0])
def test_a_body_that_comes_to_rest_within_a_step_stays_there(way):
    assert braked(way * 0.01, -way * 5.0)[1] == pytest.approx(0.0, abs=1e-15)


@pytest.mark.parametrize("way", [1.0, -1.0])
def test_a_body_that_turns_round_within_a_step_ends_with_the_speed_of_the_closed_form(way):
    """Stopped by force and friction together, then driven back by the force less the friction."""
    force = -way * 60.0
    instant = 0.02 / ((60.0 + LIMIT) / MASS)
    expected = -way * (STEP - instant) * (60.0 - LIMIT) / MASS
    assert braked(way * 0.02, force)[1] == pytest.approx(expected, rel=1e-9)


def test_a_transmission_carries_a_held_link_by_the_twist_alone():
    """A spring of 2e4 N m/rad behind a motor that is held too: the friction is what the spring pulls with."""
    give = Give(4.0, 1.0 / 2e4, link_dry=LIMIT)
    twist, ahead = np.array([5e-4]), np.array([STEP**2 / MASS])
    still = np.zeros(1)
    carried, friction = Transmission(give, twist, still, ahead, still).with_friction(
        still, still, np.array([STEP / MASS])
    )
    assert carried[0] == pytest.approx(10.0)
    assert friction[0] == pytest.approx(10.0)
