"""Forward dynamics of one joint against closed forms."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.special import ellipk

from identify.simulation.forward_dynamics import accelerations, step
from identify.simulation.torque_model import TorqueModel, Windows

STEP = 1e-3


class OneJoint(TorqueModel):
    """A joint whose torque is a formula of (q, dq, ddq, direction)."""

    def __init__(self, formula, linear=True):
        self.formula, self.linear, self.stateful, self.joints = formula, linear, [], 1
        self.gives, self.meets = {}, False

    def torque(self, windows, acceleration):
        dq = np.where(windows.dq == 0.0, 1e-12 * windows.direction, windows.dq)
        return self.formula(windows.q, dq, acceleration, windows.direction)


def at(q, dq):
    state = np.array([[float(dq)]])
    return Windows(np.zeros(1), np.array([[float(q)]]), state, np.sign(state))


def run(model, windows, duration, torque=0.0):
    """Positions and speeds at every step."""
    applied = np.full(windows.q.shape, torque)
    guess = np.zeros(windows.q.shape)
    course = [(windows.q[0, 0], windows.dq[0, 0])]
    for _ in range(round(duration / STEP)):
        beginning = accelerations(model, windows, applied, guess)
        windows, guess = step(model, windows, STEP, applied, beginning)
        course.append((windows.q[0, 0], windows.dq[0, 0]))
    return np.array(course)


@settings(deadline=None, max_examples=15)
@given(
    mass=st.floats(2.0, 20.0),
    coulomb=st.floats(10.0, 50.0),
    viscous=st.floats(0.1, 50.0),
    speed=st.floats(0.3, 1.0),
    way=st.sampled_from([-1.0, 1.0]),
)
def test_a_coasting_joint_stops_where_and_when_the_closed_form_says_and_stays(
    mass, coulomb, viscous, speed, way
):
    instant = mass / viscous * math.log1p(viscous * speed / coulomb)
    distance = mass / viscous * (speed - coulomb / viscous * math.log1p(viscous * speed / coulomb))
    model = OneJoint(lambda q, dq, ddq, way: mass * ddq + viscous * dq + coulomb * way)
    course = run(model, at(0.0, way * speed), instant + 0.05)
    assert course[-1, 1] == 0.0
    assert course[-1, 0] == pytest.approx(way * distance, rel=2e-3)
    still = np.flatnonzero(course[:, 1] == 0.0)
    assert still[0] * STEP == pytest.approx(instant, abs=2 * STEP)
    assert np.all(course[still[0] :, 0] == course[-1, 0])


@pytest.mark.parametrize(("torque", "moves"), [(4.9, 0.0), (-4.9, 0.0), (6.0, 0.5), (-7.0, -1.0)])
def test_a_joint_at_rest_moves_only_beyond_the_breakaway_torque(torque, moves):
    model = OneJoint(lambda q, dq, ddq, way: 2.0 * ddq + 5.0 * way)
    acceleration, direction = accelerations(model, at(0.0, 0.0), np.array([[torque]]), np.zeros((1, 1)))
    assert acceleration[0, 0] == pytest.approx(moves, abs=1e-9)
    assert direction[0, 0] == np.sign(moves)


def test_a_pendulum_without_friction_swings_with_the_period_of_the_elliptic_integral():
    frequency = 2 * math.pi
    amplitude = 2.0
    period = 4 * ellipk(math.sin(amplitude / 2) ** 2) / frequency
    model = OneJoint(lambda q, dq, ddq, way: ddq + frequency**2 * np.sin(q))
    course = run(model, at(amplitude, 0.0), 10 * period)
    falling = np.flatnonzero((course[:-1, 0] > 0) & (course[1:, 0] <= 0))
    exact = [(k - 1) + c[0] / (c[0] - n[0]) for k, (c, n) in ((i + 1, course[i : i + 2]) for i in falling)]
    assert np.diff(exact).mean() * STEP == pytest.approx(period, rel=1e-5)
    energy = 0.5 * course[:, 1] ** 2 + frequency**2 * (1 - np.cos(course[:, 0]))
    assert np.max(np.abs(energy / energy[0] - 1)) < 1e-4


@settings(deadline=None, max_examples=50)
@given(
    load=st.floats(-50.0, 50.0),
    speed=st.floats(-2.0, 2.0).filter(lambda value: abs(value) > 1e-3),
    driving=st.floats(0.0, 0.5),
    driven=st.floats(0.0, 0.5),
)
def test_friction_that_follows_the_load_is_solved_in_its_quadrant(load, speed, driving, driven):
    """eq. (20): the motor gives (1 + alpha_m) of the load when it drives it, (1 − alpha_g) when it is driven."""
    inertia, gravity = 3.0, 7.0

    def formula(q, dq, ddq, way):
        out = inertia * ddq + gravity
        power = np.sign(out) * way
        return out + np.abs(out) * way * np.where(power > 0, driving, driven)

    share = (1 + driving) if load * speed > 0 else (1 - driven)
    model = OneJoint(formula, linear=False)
    found, _ = accelerations(model, at(0.0, speed), np.array([[share * load]]), np.zeros((1, 1)))
    assert inertia * found[0, 0] + gravity == pytest.approx(load, abs=1e-6)


def test_motion_that_turns_keeps_its_second_order():
    """A joint driven through reversals by a constant torque against dry friction: two parabolas."""
    model = OneJoint(lambda q, dq, ddq, way: ddq + 0.5 * way)
    course = run(model, at(0.0, 1.0), 2.0, torque=-1.5)
    stop = 1.0 / 2.0
    turned = 0.5 * stop
    after = 2.0 - stop
    assert course[-1, 0] == pytest.approx(turned - 0.5 * 1.0 * after**2, abs=1e-6)
    assert course[-1, 1] == pytest.approx(-after, abs=1e-6)


@settings(deadline=None, max_examples=25)
@given(
    alpha=st.floats(0.0, 0.9),
    step=st.floats(0.0, 20.0),
    guess=st.floats(-50.0, 50.0),
    torque=st.floats(-60.0, 60.0),
    way=st.sampled_from([-1.0, 1.0]),
)
def test_where_the_load_crosses_zero_it_rests_there_or_the_only_solution_is_found(
    alpha, step, guess, torque, way
):
    """load + way (2 + α |load| + step [it drives]) = torque, load = 3 q'' + 7, by hand: three cases of the load's sign."""
    inertia, gravity, least = 3.0, 7.0, 2.0

    def formula(q, dq, ddq, direction):
        out = inertia * ddq + gravity
        drives = np.sign(out) * direction > 0
        return out + direction * (least + alpha * np.abs(out) + step * drives)

    left = torque - way * least
    if way * left > step:
        load = (left - way * step) / (1.0 + alpha)
    elif way * left < 0.0:
        load = left / (1.0 - alpha)
    else:
        load = 0.0
    model = OneJoint(formula, linear=False)
    windows = at(0.0, way * 0.5)
    found, _ = accelerations(model, windows, np.array([[torque]]), np.array([[guess]]))
    assert inertia * found[0, 0] + gravity == pytest.approx(load, abs=2e-4 * (1.0 + abs(load)))
