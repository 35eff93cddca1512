"""Bits of the error register against the table of CiA 301."""

import pytest

from drivers.simulated.error_register import error_register


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
    assert error_register(code) == register
