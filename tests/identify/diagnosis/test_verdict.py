"""When an effect of the catalogue is believed rather than a free function of its variable, and what is said of the rest."""

from __future__ import annotations

import numpy as np
import pytest

from identify.diagnosis.structure import Structure
from identify.diagnosis.verdict import MOST_OF_IT, NEARLY_ALL, imitated, part_of_free_function, verdict


def spring_parts(force: np.ndarray, noise: float = 0.02) -> float:
    """Part of what a free function of position takes away that a straight line does, over a range of -1 to 1."""
    q = np.linspace(-1, 1, len(force))
    line = np.column_stack([np.ones_like(q), q])
    left = force - line @ np.linalg.lstsq(line, force, rcond=None)[0]
    before = np.sqrt(np.var(force) + noise**2)
    return part_of_free_function(before, float(np.sqrt(np.mean(left**2) + noise**2)), noise)


def test_a_spring_with_a_little_play_keeps_its_name():
    q = np.linspace(-1, 1, 2001)
    assert spring_parts(np.sign(q) * np.maximum(np.abs(q) - 0.12, 0)) > NEARLY_ALL


@pytest.mark.parametrize("beyond", [0.2, 0.4, 0.6])
def test_a_bumper_on_one_side_is_no_spring(beyond):
    q = np.linspace(-1, 1, 2001)
    assert spring_parts(np.maximum(q - beyond, 0)) < NEARLY_ALL


def test_a_free_function_that_takes_nothing_away_gives_no_effect_a_part():
    assert part_of_free_function(0.02, 0.01, 0.03) == 0.0
    assert 0 < MOST_OF_IT < NEARLY_ALL < 1


def test_a_free_function_that_does_clearly_better_overrules_an_effect():
    assert imitated(0.01, 0.005, 1, True)
    assert not imitated(0.01, 0.0099, 1, True)


@pytest.mark.parametrize("view", [("time",), ("frequency",), ("moments",)])
def test_what_does_not_follow_the_motion_counts_even_at_the_floor(view):
    assert verdict(0.05, 0.05, 0.05, [Structure(view, 0.4, 0.05)], False) == "unexplained"
    assert verdict(0.05, 0.05, 0.05, [Structure(("q", "dq"), 0.4, 0.05)], False) == "adequate"
