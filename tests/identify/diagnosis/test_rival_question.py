"""How far rivals part on given rows, against angles and lengths that are drawn by hand."""

from __future__ import annotations

import numpy as np
import pytest

from identify.diagnosis.rival_question import Question, _choices, _Side
from identify.effects.dry_friction import LoadStribeck
from identify.effects.model import Term
from identify.effects.viscous import Stribeck
from tests.identify.effects.summaries import summary_of

BESIDE = 0
"""Column of the model with neither."""


def question(known: np.ndarray, one: _Side, other: _Side) -> Question:
    return Question(None, 0, [], None, known, [one, other])  # type: ignore[arg-type]


def side(mine: list[int], rival: list[list[int]], values: list[float], noise: float = 0.5) -> _Side:
    others = [np.array([BESIDE, *each]) for each in rival]
    return _Side(np.array(mine), others, np.array(values), noise)


def test_rivals_part_by_what_the_one_that_is_followed_better_leaves():
    """Unit columns at right angles to the model's, 30 degrees between them: sin 30 of each torque is left."""
    rows = np.eye(4)[:, :3]
    rows[:, 2] = np.cos(np.pi / 6) * rows[:, 1] + 0.5 * np.eye(4)[:, 2]
    apart = question(rows, side([1], [[2]], [4.0]), side([2], [[1]], [3.0])).apart(rows)
    assert (apart.separation, apart.further) == (pytest.approx(3.0 * 0.5 / 0.5), 0)


def test_a_rival_follows_with_whatever_constants_serve_it_best():
    rows = np.eye(5)[:, :4]
    rows[:, 3] = 0.8 * rows[:, 1] + 0.6 * np.eye(5)[:, 4]
    free = side([1], [[2], [3]], [4.0])
    apart = question(rows, free, side([2], [[1]], [4.0])).apart(rows)
    assert apart.separation == pytest.approx(4.0 * 0.6 / 0.5)


def test_a_rival_that_the_data_give_no_torque_is_parted_by_the_other_alone():
    rows = np.eye(4)[:, :3]
    apart = question(rows, side([1], [[2]], [0.0]), side([2], [[1]], [3.0])).apart(rows)
    assert (apart.separation, apart.further) == (pytest.approx(3.0 / 0.5), 0)


@pytest.mark.parametrize("second", [2.4, 2.0])
@pytest.mark.parametrize("turned", [False, True])
def test_a_special_case_parts_from_the_wider_rival_by_what_the_further_parameter_comes_to(turned, second):
    """Two ways of motion, a parameter for each, beside one for both. So far the second way was moved a third as much as
    the first; the new motion moves it seven times as much again. Estimates that are equal so far say as much of what it tells."""
    known = np.zeros((4, 4))
    known[0, 0], known[1, 1], known[2, 2] = 1.0, 3.0, 1.0
    known[:, 3] = known[:, 1] + known[:, 2]
    more = np.vstack([known, np.zeros((1, 4))])
    more[4, 2] = more[4, 3] = 7.0
    wide, narrow = side([1, 2], [[3]], [2.0, second]), side([3], [[1, 2]], [2.1])

    def deviations(rows: np.ndarray, value: float) -> float:
        """What both as one cannot follow of so much more on the second way."""
        torque = rows[:, 2] * value
        both = rows[:, 3]
        return float(np.linalg.norm(torque - both * (both @ torque) / (both @ both)))

    asked = question(known, *((narrow, wide) if turned else (wide, narrow)))
    so_far, apart = asked.apart(known), asked.apart(more)
    assert so_far.further == apart.further == 1
    assert so_far.separation == pytest.approx(deviations(known, second - 2.0) / 0.5, abs=1e-9)
    assert apart.so_far == pytest.approx(so_far.separation, abs=1e-9)
    assert apart.more == pytest.approx(deviations(more, 1.0) / deviations(known, 1.0))


def test_a_rival_is_tried_with_the_constants_that_it_shares_and_with_those_around_its_own():
    wide = Term(LoadStribeck(), 0, (("rotor_inertia", 2.0), ("stribeck_velocity", 0.05)))
    simple = Term(Stribeck(), 0, (("stribeck_velocity", 0.08),))
    listed = _choices(simple, wide, summary_of())
    assert listed[:2] == [{"stribeck_velocity": 0.08}, {"stribeck_velocity": 0.05}]
    around = [each["stribeck_velocity"] for each in listed]
    assert min(around) < 0.08 < max(around)
    assert len(set(around)) == len(around)
