"""Grids of constants, what prevents an effect, and the bounds between which backlash is searched."""

from __future__ import annotations

import numpy as np
import pytest

from identify.effects.catalogue import effects
from identify.effects.effect import finer, geometric_grid, number
from tests.identify.effects.summaries import summary_of


def values(grid, name):
    return [each[name] for each in grid if name in each]


def test_a_geometric_grid_runs_from_end_to_end_in_equal_ratios():
    assert values(geometric_grid("a", 1.0, 8.0, 4), "a") == pytest.approx([1, 2, 4, 8])
    assert values(geometric_grid("a", 3.0, 8.0, 1), "a") == [3.0]
    assert values(geometric_grid("a", 2.0, 8.0, 2), "a") == pytest.approx([2, 8])


@pytest.mark.parametrize(
    ("lowest", "highest", "value"), [(0.0, 5.0, 5.0), (5.0, 5.0, 5.0), (7.0, 5.0, 7.0), (-1.0, 5.0, 5.0)]
)
def test_where_there_is_no_range_one_value_is_tried(lowest, highest, value):
    assert geometric_grid("a", lowest, highest, 4) == [{"a": value}]


def test_finer_values_lie_on_either_side_of_the_choice_which_is_among_them():
    fine = finer("a", {"a": 3.0, "b": 7.0}, 4.0, 2)
    assert values(fine, "a") == pytest.approx([0.75, 1.5, 3.0, 6.0, 12.0])
    assert values(fine, "b") == [7.0] * 5
    assert len(finer("a", {"a": 3.0}, 2.0)) == 9


def test_numbers_in_formulas_are_exact_and_negative_ones_in_brackets():
    assert (number(0.1), number(0.0), number(-2.5)) == ("0.1", "0.0", "(-2.5)")


@pytest.mark.parametrize(("resolution", "lowest"), [(1e-5, 5e-4 * 2), (1e-3, 4e-3)])
def test_backlash_is_searched_from_four_counts_or_what_the_span_shows_to_a_twentieth_of_it(
    resolution, lowest
):
    summary = summary_of(position_resolution=resolution)
    assert summary.span == 2.0
    grid = effects()["backlash"].grid(summary)
    play = values(grid, "play")
    assert len(play) == 4
    assert (play[0], play[-1]) == (pytest.approx(lowest), pytest.approx(0.05 * 2.0))
    flank = sorted(set(values(grid, "flank_load")))
    assert (flank[0], flank[-1], len(flank)) == (pytest.approx(0.02 * 80.0), pytest.approx(0.3 * 80.0), 4)
    assert len(values(grid, "flank_load")) == 12
    one_sided = effects()["backlash"].grid(summary_of(load_range=(-5.0, 50.0)))
    assert max(values(one_sided, "flank_load")) == pytest.approx(0.3 * 50.0)


@pytest.mark.parametrize("name", sorted(effects()))
def test_the_choice_is_among_its_finer_values_and_a_search_counts_for_one_to_four(name):
    effect, summary = effects()[name], summary_of()
    grid = effect.grid(summary)
    assert effect.searched(summary) >= 1
    for constants in grid[:3]:
        fine = effect.refine(constants, summary)
        assert any(
            set(each) == set(constants) and np.allclose(list(each.values()), [constants[key] for key in each])
            for each in fine
        )


def test_the_effects_that_live_in_derivatives_are_those_that_are_easily_taken_for_each_other():
    """A mistake in the instant of a sample, a gap and a spring all turn a change of torque into a shift of position."""
    derived = {effect.name: effect for effect in effects().values() if effect.from_derivatives}
    assert set(derived) == {"backlash", "delay", "elasticity"}
    for effect in derived.values():
        assert set(effect.confusable) & set(derived)
