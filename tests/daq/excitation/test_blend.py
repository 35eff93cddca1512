"""Smooth steps: each derivative is the slope of the term before it, and nothing jumps."""

import numpy as np
import pytest

from daq.excitation.blend import fade, trapezoid

STEP = 1e-4


def slopes(terms):
    """Central differences of the first three terms."""
    return [(term[2:] - term[:-2]) / (2 * STEP) for term in terms[:3]]


@pytest.mark.parametrize(
    "terms_of",
    [
        lambda time: fade(time, 0.4, 2.0),
        lambda time: trapezoid(time, 0.3, 2.0),
        lambda time: trapezoid(time, 1.0, 2.0),
    ],
)
def test_every_term_is_the_derivative_of_the_one_before(terms_of):
    time = np.arange(0.0, 2.0 + STEP / 2, STEP)
    terms = terms_of(time)
    for slope, term in zip(slopes(terms), terms[1:], strict=True):
        np.testing.assert_allclose(slope, term[1:-1], atol=2e-3 * max(1.0, np.abs(term).max()))


def test_a_fade_rises_to_one_stays_there_and_falls_to_nothing():
    way, *rates = fade(np.array([0.0, 0.4, 1.0, 1.6, 2.0]), 0.4, 2.0)
    np.testing.assert_allclose(way, [0.0, 1.0, 1.0, 1.0, 0.0], atol=1e-12)
    for rate in rates:
        np.testing.assert_allclose(rate, 0.0, atol=1e-9)


def test_a_trapezoid_goes_its_way_and_cruises_at_the_speed_that_its_flanks_leave():
    way, velocity, acceleration, _ = trapezoid(np.array([0.0, 0.3, 1.0, 1.7, 2.0]), 0.3, 2.0)
    np.testing.assert_allclose(way[[0, 2, 4]], [0.0, 0.5, 1.0], atol=1e-12)
    np.testing.assert_allclose(velocity[1:4], 1 / (2.0 - 0.3))
    np.testing.assert_allclose(velocity[[0, 4]], 0.0, atol=1e-12)
    np.testing.assert_allclose(acceleration, 0.0, atol=1e-9)
