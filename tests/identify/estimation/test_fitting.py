"""Choosing constants and widths, against all choices tried one by one."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

import identify
from identify.estimation.fitting import choose_constants, column_price, only_slots
from tests.identify.estimation.synthetic_observation import observation_of, single
from tests.plants.single_joint import record, write_experiment

ROWS, BASE = 200, 2


def observation(strengths, widths, seed=0, scale=1.0):
    """Two base columns and slots of some widths; Y holds the first column of each slot by its strength."""
    random = np.random.default_rng(seed)
    W = random.standard_normal((ROWS, BASE + sum(widths))) * scale
    starts = BASE + np.concatenate([[0], np.cumsum(widths)])[:-1]
    Y = W[:, 0] - 2 * W[:, 1] + sum(s * W[:, at] for s, at in zip(strengths, starts, strict=True))
    made = single(W, Y + 0.1 * random.standard_normal(ROWS))
    columns = [np.arange(at, at + width) for at, width in zip(starts, widths, strict=True)]
    return replace(made, base=BASE, slots=[None] * len(widths), slot_columns=columns), W, Y  # type: ignore[list-item]


CHOICES = [{"a": float(k)} for k in range(9)]


def test_the_variant_that_explains_most_is_picked_of_each_term():
    made, *_ = observation([0, 3.0, 0, 0, 2.0], [1] * 5)
    assert choose_constants(made, [CHOICES[:3], CHOICES[:2]]) == [1, 1]
    made, *_ = observation([0, 0, 3.0, 2.0, 0], [1] * 5)
    assert choose_constants(made, [CHOICES[:3], CHOICES[:2]]) == [2, 0]
    # a term with one choice has it, and stays beside the others
    made, *_ = observation([1.0, 0, 2.0], [1] * 3)
    assert choose_constants(made, [CHOICES[:1], CHOICES[:2]]) == [0, 1]


def test_without_a_choice_nothing_is_searched_and_starts_are_kept():
    made, *_ = observation([1.0, 1.0], [1, 1])
    assert choose_constants(made, [CHOICES[:1], CHOICES[:1]]) == [0, 0]


@pytest.mark.parametrize("starts", [[0, 0], [0, 1], [2, 0], [2, 1]])
def test_wherever_the_search_starts_it_ends_at_the_least_residual_of_all_pairs(starts):
    """Columns that are alike in part, each of the six pairs fitted for itself."""
    random = np.random.default_rng(1)
    a, b, c, base = random.standard_normal((4, ROWS))
    W = np.column_stack([base, a + c, a + 0.3 * c, a, b + c, b])
    Y = base + a + b + 0.01 * random.standard_normal(ROWS)
    made = replace(
        single(W, Y),
        base=1,
        slots=[None] * 5,  # type: ignore[list-item]
        slot_columns=[np.array([k]) for k in range(1, 6)],
    )
    left = {
        (one, two): np.linalg.lstsq(W[:, [0, 1 + one, 4 + two]], Y, rcond=None)[1][0]
        for one in range(3)
        for two in range(2)
    }
    assert choose_constants(made, [CHOICES[:3], CHOICES[:2]], starts_at=starts) == list(
        min(left, key=left.get)
    )


def test_without_the_robot_s_own_columns_only_the_terms_explain():
    made, W, _ = observation([0, 0], [1, 1])
    W = W.copy()
    W[:, 2] = W[:, 1] + 0.5 * W[:, 2]  # the first choice is nearly a base column
    other = single(W, W[:, 0] - 2 * W[:, 1])
    other = replace(other, base=BASE, slots=made.slots, slot_columns=made.slot_columns)
    assert choose_constants(other, [CHOICES[:2]], inertial=False) == [0]


def test_the_price_of_a_column_is_mallows_of_what_the_widest_choice_leaves():
    explained = np.array([1.0, 6.0])
    assert column_price(10.0, explained, 40) == pytest.approx(2 * 4.0 / 40)
    assert column_price(10.0, explained, 40, joints=2) == pytest.approx(2 * 4.0 / 2 / 40)
    assert column_price(5.0, explained, 40) == 0.0
    assert column_price(10.0, explained, 0) == pytest.approx(8.0)


@pytest.mark.parametrize(("second", "picked"), [(0.0, 0), (1.0, 1)])
def test_a_wider_choice_is_picked_only_where_its_columns_are_worth_their_price(second, picked):
    random = np.random.default_rng(2)
    W = random.standard_normal((ROWS, 4))
    Y = W[:, 0] + 3 * W[:, 1] + second * W[:, 3] + 0.3 * random.standard_normal(ROWS)
    wide = np.column_stack([W[:, 0], W[:, 1], W[:, 1], W[:, 3]])
    wide[:, 2] += 1e-3 * W[:, 2]
    made = replace(
        single(wide, Y),
        base=1,
        slots=[None, None],  # type: ignore[list-item]
        slot_columns=[np.array([1]), np.array([2, 3])],
    )
    assert choose_constants(made, [CHOICES[:2]]) == [picked]


def test_an_observation_with_some_of_its_slots_is_that_made_of_their_columns():
    random = np.random.default_rng(3)
    rows = [random.standard_normal((60, 5)), random.standard_normal((60, 4))]
    joint_columns = [np.array([0, 2, 3, 5]), np.array([1, 2, 4])]
    made = replace(
        observation_of(rows, joint_columns, 6),
        base=2,
        slots=["a", "b", "c"],  # type: ignore[list-item]
        slot_columns=[np.array([2]), np.array([3, 4]), np.array([5])],
    )
    found = only_slots(made, [2, 0])
    assert found.slots == ["c", "a"]
    assert [columns.tolist() for columns in found.slot_columns] == [[2], [3]]
    assert [columns.tolist() for columns in found.joint_columns] == [[0, 3, 2], [1, 3]]
    assert found.width == 4
    for joint, places in enumerate([[0, 1, 3, 4, 4], [0, 1, 3, 3]]):
        wanted = rows[joint][:, places]
        merged = found.merged(joint).r
        np.testing.assert_allclose(merged.T @ merged, wanted.T @ wanted, rtol=1e-9, atol=1e-9)


@pytest.mark.parametrize(
    "add", [["drive-gain", "current-ripple"], ["current-ripple", "drive-gain"]], ids=["after", "before"]
)
def test_a_ripple_is_found_beside_a_drive_gain_that_hides_it(tmp_path, add):
    """The test joint's ripple has 60 waves a radian; a gain that is 10 % off leaves a residual six times as large."""
    hidden = record({"drive-gain": 2.0, "current-ripple": 0.03}, duration=12.0, rate=250.0, repeats=1)
    found = identify.identify(identify.load_experiment(write_experiment(tmp_path, hidden)), "usual", add=add)
    constants = {t.effect.name: dict(t.constants or ()) for t in found.fitted.model.terms}
    assert constants["current-ripple"]["wave_number"] == pytest.approx(60, rel=0.01)
