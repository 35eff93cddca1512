"""Sums of harmonics, against the formula and its differences."""

import itertools

import numpy as np
import pytest
from pydantic import ValidationError

from daq.excitation.sinusoid import Sinusoids

PHASE = Sinusoids(
    frequency=0.5,
    repeats=2,
    fade=0.5,
    centre=(0.2, -0.1),
    cosine=((0.1, 0.02), (0.0, 0.03)),
    sine=((0.0, 0.05), (0.2, 0.0)),
)


def test_between_the_fades_it_is_the_sum_of_its_harmonics():
    time = np.linspace(0.5, 4.5, 41)
    position, velocity, acceleration, jerk = PHASE.evaluate(time, np.zeros(2))
    angle = 2 * np.pi * 0.5 * (time - 0.5)
    first = 0.2 + 0.1 * np.cos(angle) + 0.02 * np.cos(2 * angle) + 0.05 * np.sin(2 * angle)
    np.testing.assert_allclose(position[:, 0], first, atol=1e-12)
    rate = np.pi * (-0.1 * np.sin(angle) - 0.04 * np.sin(2 * angle) + 0.1 * np.cos(2 * angle))
    np.testing.assert_allclose(velocity[:, 0], rate, atol=1e-12)
    assert acceleration.shape == jerk.shape == (41, 2)


def test_it_repeats_exactly_and_says_where():
    begin, end = PHASE.repeated
    assert (begin, end, PHASE.duration) == (0.5, 4.5, 5.0)
    time = np.linspace(begin, begin + 2.0, 30)
    for first, second in zip(
        PHASE.evaluate(time, np.zeros(2)), PHASE.evaluate(time + 2.0, np.zeros(2)), strict=True
    ):
        np.testing.assert_allclose(first, second, atol=1e-9)


def test_with_the_fades_each_term_is_the_derivative_of_the_one_before():
    step = 1e-4
    time = np.arange(0.0, PHASE.duration + step / 2, step)
    terms = PHASE.evaluate(time, np.zeros(2))
    for before, term in itertools.pairwise(terms):
        slope = (before[2:] - before[:-2]) / (2 * step)
        np.testing.assert_allclose(slope, term[1:-1], atol=2e-3 * np.abs(term).max())


def test_it_begins_and_ends_at_rest_in_its_centre():
    for index, wanted in enumerate(([0.2, -0.1], [0.0, 0.0], [0.0, 0.0], [0.0, 0.0])):
        ends = PHASE.evaluate(np.array([0.0, PHASE.duration]), np.zeros(2))[index]
        np.testing.assert_allclose(ends, [wanted, wanted], atol=1e-9)
    np.testing.assert_array_equal(PHASE.end(np.zeros(2)), [0.2, -0.1])


def test_rows_of_different_length_are_refused():
    with pytest.raises(ValidationError, match="2 rows with the same number of harmonics"):
        Sinusoids(
            frequency=1.0,
            repeats=1,
            fade=0.1,
            centre=(0.0, 0.0),
            cosine=((1.0,), (1.0, 2.0)),
            sine=((0.0,), (0.0,)),
        )
