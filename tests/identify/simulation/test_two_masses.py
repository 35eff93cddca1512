"""A motor and a link with a give between them, against closed forms of the two-mass oscillator."""

from __future__ import annotations

import math

import numpy as np
import pytest

from identify.effects.give import Give
from identify.effects.hysteresis import Backlash
from identify.simulation.torque_model import LINK, LINK_SPEED, TorqueModel, Windows
from identify.simulation.two_masses import TwoMasses, oscillations
from tests.identify.effects.motions import motion_of

ROTOR, BODY, STIFFNESS = 4.0, 8.0, 2.0e4
WHOLE = ROTOR + BODY
SHARE = BODY / WHOLE
RESONANCE = math.sqrt(STIFFNESS * (1.0 / ROTOR + 1.0 / BODY))


class OneJoint(TorqueModel):
    """A joint whose bodies have an inertia alone, with dry friction on its motor."""

    def __init__(self, give, dry=0.0):
        self.gives, self.dry, self.joints = {0: give}, dry, 1
        self.linear, self.stateful, self.meets = True, [], False

    def load(self, windows, acceleration):
        return WHOLE * acceleration

    def torque_and_load(self, windows, acceleration):
        load = self.load(windows, acceleration)
        return load + self.dry * windows.direction, load


def at(motor=0.0, link=0.0, motor_speed=0.0, link_speed=0.0):
    speed = np.array([[float(motor_speed)]])
    memory = {(LINK, 0): np.array([float(link)]), (LINK_SPEED, 0): np.array([float(link_speed)])}
    return Windows(np.zeros(1), np.array([[float(motor)]]), speed, np.sign(speed), memory=memory)


def run(model, windows, duration, step, torque=0.0, row=4e-3):
    """(steps, 5): time, positions of motor and link, their speeds."""
    applied = np.array([[float(torque)]])
    masses = TwoMasses(model, windows, step, row)
    guess = np.zeros((1, 2))
    course = []
    for number in range(round(duration / step) + 1):
        link = windows.memory[LINK, 0][0], windows.memory[LINK_SPEED, 0][0]
        course.append((number * step, windows.q[0, 0], link[0], windows.dq[0, 0], link[1]))
        windows, guess = masses.step(windows, applied, masses.begin(windows, applied, guess))
    return np.array(course).T


def test_after_a_step_of_torque_motor_and_link_move_as_the_closed_form_says():
    time, motor, link, *_ = run(OneJoint(Give(ROTOR, 1.0 / STIFFNESS)), at(), 0.4, 1e-3, torque=60.0)
    mean = 0.5 * 60.0 / WHOLE * time**2
    twist = 60.0 / ROTOR / RESONANCE**2 * (1.0 - np.cos(RESONANCE * time))
    largest = np.max(twist)
    np.testing.assert_allclose(motor, mean + SHARE * twist, atol=0.02 * largest)
    np.testing.assert_allclose(link, mean - (1.0 - SHARE) * twist, atol=0.02 * largest)


def test_without_damping_it_swings_at_its_resonance_and_keeps_its_energy():
    give = Give(ROTOR, 1.0 / STIFFNESS)
    assert oscillations(OneJoint(give), at()) == pytest.approx({0: RESONANCE})
    time, motor, link, motor_speed, link_speed = run(OneJoint(give), at(motor=1e-3), 1.0, 1e-3)
    twist = motor - link
    falling = np.flatnonzero((twist[:-1] > 0) & (twist[1:] <= 0))
    zeros = time[falling] + 1e-3 * twist[falling] / (twist[falling] - twist[falling + 1])
    assert 2 * np.pi / np.diff(zeros).mean() == pytest.approx(RESONANCE, rel=2e-3)
    energy = 0.5 * (ROTOR * motor_speed**2 + BODY * link_speed**2) + give.energy(STIFFNESS * twist)
    np.testing.assert_allclose(energy, energy[0], rtol=1e-4)  # what finding the reversals of the motor costs


@pytest.mark.parametrize("stiffness", [3e6, 1e9])
def test_a_spring_stiffer_than_the_rows_can_show_follows_its_load(stiffness):
    """The mean of both masses moves as one body, the twist is that of the load, whatever the step."""
    time, motor, link, *_ = run(OneJoint(Give(ROTOR, 1.0 / stiffness)), at(), 0.4, 4e-3, torque=60.0)
    mean = (ROTOR * motor + BODY * link) / WHOLE
    np.testing.assert_allclose(mean, 0.5 * 60.0 / WHOLE * time**2, atol=1e-9)
    settled = time > 0.1
    np.testing.assert_allclose((motor - link)[settled], 60.0 * SHARE / stiffness, rtol=1e-3, atol=1e-12)


def test_a_motor_that_friction_holds_lets_its_link_swing():
    give = Give(ROTOR, 1.0 / STIFFNESS)
    time, motor, link, *_ = run(OneJoint(give, dry=50.0), at(link=-1e-3), 0.5, 1e-3)  # 20 N m on the motor
    assert np.all(motor == 0.0)
    np.testing.assert_allclose(link, -1e-3 * np.cos(math.sqrt(STIFFNESS / BODY) * time), atol=2e-5)


def test_a_link_crosses_its_gap_freely_and_is_caught():
    """A motor at rest, a link that comes with a speed: until half the gap it flies, then the motor takes of its momentum."""
    give = Give(ROTOR, gap=4e-3, flank_load=0.5)
    time, motor, link, motor_speed, link_speed = run(OneJoint(give), at(link_speed=0.1), 0.1, 1e-3)
    flying = time <= 0.015
    np.testing.assert_allclose(link[flying], 0.1 * time[flying], atol=6e-5)
    np.testing.assert_allclose(ROTOR * motor_speed + BODY * link_speed, BODY * 0.1, rtol=1e-9)
    assert np.all(np.abs(motor - link) <= 2e-3 * (1 + 1e-9))
    assert motor_speed[-1] > 0.02


def test_a_link_that_rubs_brakes_in_its_gap_and_rests_there():
    """16 N m on 8 kg m²: 0.1 rad/s end after 0.05 s and 2.5 mrad, within the gap; a motor at rest is not met."""
    give = Give(ROTOR, gap=0.02, flank_load=1e-6, link_dry=16.0)
    time, motor, link, _, link_speed = run(OneJoint(give), at(link_speed=0.1), 0.3, 1e-3)
    braking = np.minimum(time, 0.05)
    np.testing.assert_allclose(link, 0.1 * braking - braking**2, atol=6e-5)
    np.testing.assert_allclose(link_speed[time > 0.052], 0.0, atol=1e-12)
    np.testing.assert_allclose(motor, 0.0, atol=6e-5)


def test_a_motor_crosses_the_gap_before_a_link_that_rubs_and_takes_it_along():
    """The link rests until the motor meets it, momentum is shared then, and both are driven by what friction leaves."""
    give = Give(ROTOR, gap=0.01, flank_load=1e-3, link_dry=20.0)
    begun = at(motor=-0.005)
    time, _, link, speed, link_speed = run(OneJoint(give), begun, 0.4, 1e-3, torque=26.0)
    met = math.sqrt(2 * 0.01 * ROTOR / 26.0)
    resting = time < met - 2e-3
    np.testing.assert_allclose(link[resting], 0.0, atol=1e-7)
    after = time > met + 0.02
    shared = 26.0 * met / WHOLE + (26.0 - 20.0) / WHOLE * (time - met)
    np.testing.assert_allclose(speed[after], shared[after], rtol=0.02)
    np.testing.assert_allclose(link_speed[after], shared[after], rtol=0.02)


def test_friction_holds_a_link_on_a_spring_that_pulls_less():
    give = Give(ROTOR, 1.0 / STIFFNESS, link_dry=25.0)
    _, motor, link, *_ = run(OneJoint(give, dry=50.0), at(motor=1e-3), 0.3, 1e-3)  # 20 N m
    np.testing.assert_allclose(link, 0.0, atol=1e-12)
    np.testing.assert_allclose(motor, 1e-3, atol=1e-12)
    _, _, link, *_ = run(
        OneJoint(Give(ROTOR, 1.0 / STIFFNESS, link_dry=5.0), dry=50.0), at(motor=1e-3), 0.3, 1e-3
    )
    # of each half of a swing friction takes twice 5/20000 rad
    assert np.max(link) == pytest.approx(2e-3 - 2 * 0.25e-3, rel=0.02)
    assert abs(link[-1] - 1e-3) <= 0.25e-3


def test_across_a_gap_pushed_by_motion_the_state_has_the_columns_of_the_course():
    constants = {"play": 0.05}
    slope = np.full(500, 3.0)
    seen = motion_of(load_slope_of=lambda: slope)
    columns = Backlash().columns(seen, constants)
    state = Backlash().state_at_start(seen.direction[:1])
    states = [state]
    for travel in np.diff(seen.q):
        states.append(Backlash().state_after(states[-1], np.array([travel]), constants))
    place = np.concatenate(states)
    found = Backlash().columns_of_state(seen, place, constants)
    np.testing.assert_allclose(found[:, 0], columns[:, 0], atol=1e-9)
    crossing = (np.abs(place) < 0.49) & (np.arange(500) > 5)
    inner = np.flatnonzero(crossing)[3:-3]
    inner = inner[crossing[inner - 3] & crossing[inner + 3]]
    assert len(inner) > 10
    np.testing.assert_allclose(found[inner, 1], columns[inner, 1], rtol=1e-2)


def test_a_link_met_across_the_gap_takes_its_inertia_from_the_motor_at_once():
    values = np.array([0.01, -0.08])
    taken = Backlash().impact(np.array([-0.5, 0.2, 0.5]), np.array([-0.5, 0.5, 0.4]), values, {"play": 0.01})
    np.testing.assert_allclose(taken, [0.0, 8.0, 0.0])
