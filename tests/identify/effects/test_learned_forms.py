"""Descriptions are own effects: tables are linear between their points, forms are what their names say."""

from __future__ import annotations

import numpy as np
import pytest

from identify.effects.learned_forms import (
    LIBRARY,
    MOST_COLUMNS,
    at_points,
    closed_forms,
    searched_finer,
    tables,
    variables_of,
)
from tests.identify.effects.motions import motion_of
from tests.identify.effects.summaries import summary_of

SUMMARY = summary_of(position_range=(-0.8, 0.8), maximum_speed=6.0)
MOTION = motion_of()


def variable(name):
    return next(each for each in variables_of(SUMMARY, [SUMMARY]) if each.name == name)


@pytest.mark.parametrize("name", ["q", "dq"])
def test_a_table_is_linear_between_its_points(name):
    over, position = variable(name), MOTION.q if name == "q" else np.abs(MOTION.dq)
    factors = {
        "plain": [np.ones_like(MOTION.q)],
        "turned": [MOTION.direction],
        "both": [np.maximum(0, -MOTION.direction), np.maximum(0, MOTION.direction)],
    }
    tried = list(tables(over, SUMMARY))
    assert {table.sense for table in tried} == set(factors)
    for table in tried:
        columns = table.effect.columns(MOTION, {})
        assert columns.shape[1] <= MOST_COLUMNS
        values = np.random.default_rng(1).normal(size=columns.shape[1])
        told = at_points(table, values)
        curves = np.split(values, len(factors[table.sense]))
        expected = np.zeros_like(MOTION.q)
        for factor, curve in zip(factors[table.sense], curves, strict=True):
            ends = [0.0] if len(curve) == len(table.knots) - 2 else []
            expected += factor * np.interp(position, table.knots, [0.0, *curve, *ends])
        np.testing.assert_allclose(columns @ values, expected, atol=2e-4)
        assert told.shape == ((len(table.knots),) if table.sense == "plain" else (len(table.knots), 2))


@pytest.mark.parametrize(
    ("name", "columns"),
    [
        # 4, 6, 9 and 13 points, of which the first is zero, and up to twelve columns
        ("q", {"plain": [3, 5, 8, 12], "turned": [3, 5, 8, 12], "both": [6, 10]}),
        # a straight line over the speed is in every model, so that the last is zero too
        ("dq", {"plain": [2, 4, 7, 11], "turned": [2, 4, 7, 11], "both": [4, 8]}),
    ],
)
def test_tables_have_a_column_for_every_point_that_is_not_zero_in_either_direction_or_in_each(name, columns):
    made = {sense: [] for sense in columns}
    for table in tables(variable(name), SUMMARY):
        made[table.sense].append(table.effect.columns(MOTION, {}).shape[1])
    assert made == columns


def test_every_form_is_searched_inside_the_range_and_finer_around_the_choice():
    over = variable("q")
    forms = list(closed_forms(over, "turned", SUMMARY))
    assert {form.form for form in forms} <= set(LIBRARY)
    for form in forms:
        choices = form.effect.grid(SUMMARY)
        assert 0 < len(choices) <= 64
        chosen = choices[len(choices) // 2]
        columns = form.effect.columns(MOTION, chosen)
        assert np.all(np.isfinite(columns))
        finer = searched_finer(form, chosen)
        for constant, value in chosen.items():
            listed = sorted({each[constant] for each in finer.effect.grid(SUMMARY)})
            assert listed[0] <= value * (1 + 1e-5)
            assert value * (1 - 1e-5) <= listed[-1]
            assert listed[-1] - listed[0] < 0.6 * (
                max(c[constant] for c in choices) - min(c[constant] for c in choices)
            )
        assert len(finer.effect.grid(SUMMARY)) <= 64


@pytest.mark.parametrize("place", [0, 1, -2, -1])
def test_the_finer_search_for_an_edge_goes_from_neighbour_to_neighbour_of_the_choice(place):
    forms = [
        each
        for each in closed_forms(variable("q"), "plain", SUMMARY)
        if set(each.effect.grid(SUMMARY)[0]) == {"edge"}
    ]
    assert forms
    for form in forms:
        coarse = {"edge": sorted(each["edge"] for each in form.effect.grid(SUMMARY))}
        chosen = {name: values[place] for name, values in coarse.items()}
        finer = searched_finer(form, chosen).effect.grid(SUMMARY)
        for name, values in coarse.items():
            at = place % len(values)
            ends = values[max(at - 1, 0)], values[min(at + 1, len(values) - 1)]
            tried = sorted(each[name] for each in finer)
            assert (tried[0], tried[-1]) == pytest.approx(ends, rel=1e-4, abs=1e-9)


def test_names_that_are_taken_are_not_given_again():
    plain = variable("q").effect
    again = next(each for each in variables_of(SUMMARY, [SUMMARY], {plain}) if each.name == "q").effect
    assert again == f"{plain}-2"
