"""Gains of the loop over the bus: margins by another way than the design's; the loop against an arm that is integrated here."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from daq.torque_loop import PHASE_MARGIN, AxisDynamics, RunningLoop, TorqueLoop, design, require_loop
from identify.recording.errors import InputError


def loop_of(gains, bound=100_000):
    """One axis whose counts are radians and whose per mille are N m."""
    one = [np.array([each]) for each in (gains.proportional, gains.integral, gains.derivative)]
    return TorqueLoop(*one, np.array([bound]), np.array([gains.crossover]))


def encirclements(gains, inertia, stiffness, dead, turned):
    """Closed-loop poles in the right half plane, the loop turned by `turned` degrees: by the argument principle over a contour
    of the characteristic function."""
    w = np.concatenate([-np.geomspace(3e3, 1e-4, 60_000), np.geomspace(1e-4, 3e3, 60_000)])
    s = 1j * w + 1e-4
    controller = gains.derivative * s + gains.proportional + gains.integral / s
    turn = np.exp(-1j * np.radians(turned) * np.sign(w))
    function = s * (inertia * s**2 + stiffness) + s * controller * np.exp(-dead * s) * turn
    function = function / (s + 5.0) ** 3
    return round(-np.diff(np.unwrap(np.angle(function)))[:].sum() / (2 * np.pi))


@settings(max_examples=20, deadline=None)
@given(
    inertia=st.floats(0.01, 100.0),
    spread=st.floats(1.0, 1.6),
    cycle=st.floats(0.001, 0.01),
    heavy=st.floats(0.0, 4.0),
)
def test_every_pose_keeps_its_phase_margin(inertia, spread, cycle, heavy):
    """A pendulum of that inertia, hanging or upright: stable when its loop lags by almost the margin more, and only then."""
    stiffness = inertia * heavy**2
    gains = design(AxisDynamics((inertia, spread * inertia), stiffness), cycle)
    assert gains is not None
    for felt in (inertia, spread * inertia):
        for each in (-stiffness, stiffness):
            assert encirclements(gains, felt, each, 2.0 * cycle, PHASE_MARGIN - 2.0) == 0
    assert encirclements(gains, inertia, 0.0, 2.0 * cycle, PHASE_MARGIN + 8.0 * spread) != 0
    assert gains.crossover <= 0.33 / (2.0 * cycle)


def test_a_cycle_that_is_too_long_for_gravity_is_refused_with_what_would_help():
    falls_fast = AxisDynamics((1.0, 1.0), 400.0)
    assert design(falls_fast, 0.001) is not None
    with pytest.raises(InputError, match=r"j2: at a cycle of 20 ms no position loop .*a shorter cycle"):
        require_loop("j2", design(falls_fast, 0.02), 0.02)
    assert design(AxisDynamics((1.0, 6.0), 0.0), 0.002) is None


@pytest.mark.parametrize(("cycle", "largest"), [(0.002, 2e-3), (0.005, 2e-2)])
def test_an_arm_that_is_held_over_the_bus_follows_and_stays_where_it_is_put(cycle, largest):
    """An upright pendulum of 31 kg m² and 247 N m, its position a cycle old: taken over from the torque that holds it."""
    inertia, weight = 31.0, 247.0
    running = RunningLoop(loop_of(design(AxisDynamics((inertia, inertia), weight), cycle)), cycle)
    angle, speed = 1.3, 0.0
    running.begin([weight * np.cos(angle)])
    steps, torque, pending = 20, weight * np.cos(angle), weight * np.cos(angle)
    errors = []
    for k in range(round(4.0 / cycle)):
        time = k * cycle
        wanted = 1.3 - 0.2 * (1 - np.cos(1.5 * min(time, 2 * np.pi / 1.5)))
        torque, pending = pending, running.torque([wanted - angle], None)[0]
        errors.append(wanted - angle)
        for _ in range(steps):
            speed += (torque - weight * np.cos(angle)) / inertia * cycle / steps
            angle += speed * cycle / steps
    assert np.abs(errors).max() < largest
    assert np.abs(errors[:5]).max() < 1e-4  # no jump at the take-over


def test_at_its_bound_the_integral_waits_and_comes_back():
    gains = design(AxisDynamics((1.0, 1.0), 0.0), 0.002)
    running = RunningLoop(loop_of(gains, bound=50), 0.002)
    running.begin([0.0])
    assert {running.torque([5.0], None)[0] for _ in range(500)} == {50}
    running.torque([0.0], None)
    assert abs(running.torque([0.0], None)[0]) <= 50
    running.torque([0.0], [0.0])
    assert running.torque([0.0], [900.0]) == [50]
