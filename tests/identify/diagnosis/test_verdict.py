"""When an effect of the catalogue is believed rather than a free function of its variable, and what is said of the rest."""

from __future__ import annotations

import numpy as np
import pytest

from identify.diagnosis.deciding_constants import NEARLY_ALL
from identify.diagnosis.structure import Structure
from identify.diagnosis.verdict import imitated, left_over, part_of_free, verdict
from identify.validation.noise_floor import NoiseFloor


def spring_parts(force: np.ndarray, noise: float = 0.02) -> float:
    """Part of what a free function of position takes away that a straight line does, over a range of -1 to 1."""
    q = np.linspace(-1, 1, len(force))
    line = np.column_stack([np.ones_like(q), q])
    left = force - line @ np.linalg.lstsq(line, force, rcond=None)[0]
    before = np.sqrt(np.var(force) + noise**2)
    return part_of_free(before, float(np.sqrt(np.mean(left**2) + noise**2)), noise)


def test_a_spring_with_a_little_play_keeps_its_name():
    q = np.linspace(-1, 1, 2001)
    part = spring_parts(np.sign(q) * np.maximum(np.abs(q) - 0.12, 0))
    assert part >= NEARLY_ALL


@pytest.mark.parametrize("beyond", [0.2, 0.4, 0.6])
def test_a_bumper_on_one_side_is_no_spring(beyond):
    q = np.linspace(-1, 1, 2001)
    part = spring_parts(np.maximum(q - beyond, 0))
    assert part < NEARLY_ALL


def test_a_free_function_that_takes_nothing_away_gives_no_effect_a_part():
    assert part_of_free(0.02, 0.01, 0.03) == 0.0


def test_a_free_function_that_does_clearly_better_overrules_an_effect():
    assert imitated(0.01, 0.005, 1, True)
    assert not imitated(0.01, 0.0099, 1, True)


def test_several_effects_are_believed_if_they_do_better_than_one_free_function():
    assert imitated(0.010, 0.0099, 2, False)
    assert not imitated(0.010, 0.0101, 2, False)
    assert not imitated(0.010, 0.0099, 1, False)


def test_one_free_function_must_lead_several_effects_by_what_its_further_parameters_must_bring():
    lead = 0.010**2 - 0.0098**2
    assert imitated(0.010, 0.0097, 2, False, lead=lead)
    assert not imitated(0.010, 0.0099, 2, False, lead=lead)


def test_several_effects_of_one_variable_that_leave_something_over_it_imitate_the_cause():
    assert imitated(0.004, 0.010, 2, True, left_over=True)
    assert not imitated(0.004, 0.010, 4, True, left_over=False)
    assert not imitated(0.004, 0.010, 4, False, left_over=True)
    assert not imitated(0.004, 0.010, 1, True, left_over=True)


def test_what_is_left_over_a_variable_is_over_it_and_its_direction_alone_and_more_than_rounding():
    over = Structure(("q", "direction"), 0.4, 0.05)
    assert left_over("q", [over], 0.01)
    assert not left_over("dq", [over], 0.01)
    assert not left_over("q", [over], 1e-4)
    assert not left_over("q", [Structure(("q", "dq", "load"), 0.4, 0.05)], 0.01)


@pytest.mark.parametrize("view", [("time",), ("frequency",), ("moments",)])
def test_what_does_not_follow_the_motion_counts_even_at_the_floor(view):
    floor = NoiseFloor(0.049, 0.048, 0.05)
    assert verdict(0.05, 0.05, floor, [Structure(view, 0.4, 0.05)], False) == "unexplained"
    over_motion = [Structure(("q", "dq"), 0.4, 0.05)]
    assert verdict(0.05, 0.05, floor, over_motion, False) == "adequate"
    assert verdict(0.05, 0.0501, floor, over_motion, False) == "unexplained"


def test_an_error_of_which_noise_is_less_than_half_the_power_leaves_structure_that_no_predictor_finds():
    floor = NoiseFloor(0.05, 0.049, 0.051)
    assert verdict(0.0707, 0.0707, floor, [], False) == "adequate"
    assert verdict(0.0708, 0.0708, floor, [], False) == "unexplained"


def test_an_effect_that_explains_a_little_of_a_disturbance_does_not_explain_it_whatever_the_floor():
    floor = NoiseFloor(0.072, 0.07, 0.074)
    jumps = [Structure(("time", "direction"), 0.87, 0.13)]
    assert verdict(0.069, 0.061, floor, jumps, True) == "unexplained"
    assert verdict(0.069, 0.010, floor, jumps, True) == "missing"
