"""The simulated drive's own arithmetic: filter of the velocity."""

from __future__ import annotations

import math

import pytest

from drivers.simulated.servo import Servo
from drivers.simulated.settings import ServoSettings, SimulatedAxis


@pytest.mark.parametrize("filter_time", [0.0, 2e-3])
def test_the_drive_believes_a_velocity_behind_a_low_pass_of_first_order(filter_time):
    axis = SimulatedAxis(node=1, servo=ServoSettings(velocity_filter=filter_time))
    servo = Servo(axis)
    servo.observe(100, 1e-3)
    assert servo.velocity == 0.0  # one position tells nothing
    servo.observe(140, 1e-3)
    first = 40_000.0 * (1.0 if filter_time == 0.0 else 1.0 - math.exp(-0.5))
    assert servo.velocity == pytest.approx(first)
    servo.shift(1000)  # another zero is no motion
    servo.observe(1140, 1e-3)
    assert servo.velocity == pytest.approx(0.0 if filter_time == 0.0 else first * math.exp(-0.5))
