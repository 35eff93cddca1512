"""Constants of effects are said in the units in which people think: waves are those that can be counted."""

import numpy as np
import pytest

from api.pages.constant_words import constant_words
from api.pages.error_figures import JointUnits
from api.pages.number_format import THIN

HINGE, SLIDE = JointUnits.of("revolute"), JointUnits.of("prismatic")


def maxima(values):
    """How many maxima a periodic signal has."""
    return int(np.count_nonzero((values > np.roll(values, 1)) & (values >= np.roll(values, -1))))


def said(name, value, units=HINGE, ratio=1.0):
    ((_words, text),) = constant_words({name: value}, units, ratio)
    return text.replace(THIN, " ")


@pytest.mark.parametrize(("wave_number", "ratio"), [(40.0, 20.0), (19.0, 1.0), (202.0, 101.0)])
def test_waves_are_those_that_one_counts_over_a_turn(wave_number, ratio):
    turn = np.linspace(0.0, 2 * np.pi, 100_000, endpoint=False)
    joint, motor = maxima(np.cos(wave_number * turn)), maxima(np.cos(wave_number * turn / ratio))
    text = f"{joint} of the joint" + (f", {motor} of the motor" if ratio != 1.0 else "")
    assert said("wave_number", wave_number, ratio=ratio) == text


def test_a_number_of_waves_that_is_not_whole_is_not_rounded_to_one():
    assert said("wave_number", 40.1) == "40.1 of the joint"
    assert said("wave_number", 40.01) == "40 of the joint"
    assert said("wave_number", 0.01) == "0.0100 of the joint"


def test_waves_of_a_slide_have_a_length():
    pitch, ratio = 0.005, 2 * np.pi / 0.005  # a spindle of 5 mm: one turn of the motor for each
    assert said("wave_number", 2 * np.pi / pitch, SLIDE, ratio) == "one every 5.00 mm, 1 of the motor"


def test_small_ways_are_mrad_or_mm_and_speeds_have_rpm_where_something_turns():
    assert said("play", 0.0004) == "0.400 mrad"
    assert said("play", 0.0004, SLIDE) == "0.400 mm"
    assert said("stribeck_velocity", np.pi) == "3.14 rad/s (30 rpm)"
    assert said("stribeck_velocity", 0.012, SLIDE) == "12.0 mm/s"


def test_constants_that_are_zero_or_of_the_grid_are_not_said():
    assert constant_words({"wave_number": 0.0, "grid_index": 3.0}, HINGE) == []
