"""The simulated drive's own arithmetic: error register, filter of the velocity."""

from __future__ import annotations

import math

import pytest

from drivers.simulated.servo import Servo
from drivers.simulated.settings import ServoSettings, SimulatedAxis
from drivers.simulated.simulated_drive import _register_of


@pytest.mark.parametrize(
    ("code", "register"),
    [
        (0x2310, 0x03),  # current
        (0x3210, 0x05),  # voltage
        (0x4310, 0x09),  # temperature
        (0x7500, 0x11),  # communication
        (0x8130, 0x11),
        (0x8250, 0x11),
        (0x8311, 0x21),  # of the device profile
        (0x8611, 0x21),
        (0x8A00, 0x21),
        (0x9000, 0x01),  # generic alone
        (0x7305, 0x01),
    ],
)
def test_the_error_register_has_the_bit_of_the_code_s_class(code, register):
    """CiA 301, 7.5.2.2: generic, current, voltage, temperature, communication, device profile."""
    assert _register_of(code) == register


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
