"""Varying a constant reaches everything that imported it, and the reduced bench takes the cases on which it can show."""

from __future__ import annotations

from types import SimpleNamespace

import pytest

from identify.diagnosis import deciding_constants, finding, selection, structure
from identify.diagnosis.deciding_constants import STRUCTURE_RIGHT
from tests.sensitivity.__main__ import DECIDING, HOME, SIZES, other_values, varied
from tests.sensitivity.reduced_bench import Known, Said, _Wanted, undecided


def test_a_constant_is_varied_in_every_module_that_imported_it_and_put_back():
    before = deciding_constants.SIGNIFICANCE
    with varied("SIGNIFICANCE", HOME, 0.5):
        assert [each.SIGNIFICANCE for each in (deciding_constants, finding, selection, structure)] == [
            0.5
        ] * 4
    assert [each.SIGNIFICANCE for each in (deciding_constants, finding, selection, structure)] == [before] * 4


def test_a_constant_of_the_same_name_in_another_module_is_left_alone():
    from identify.diagnosis import disturbance, held_out

    with varied("RIDGE", SIZES["RIDGE"], 0.5):
        assert disturbance.RIDGE == 0.5
        assert held_out.RIDGE != 0.5


def test_every_constant_that_is_varied_is_where_it_is_said_to_be():
    for name, module in {**DECIDING, **SIZES}.items():
        with varied(name, module, 123.0):
            pass


@pytest.mark.parametrize(
    ("value", "less", "more"),
    [(0.02, 0.01, 0.04), (10, 5, 20), (0.9, 0.8, 0.95), (0.5, 0.25, 1.0), (1, 1, 2)],
)
def test_half_and_double_or_the_distance_from_one(value, less, more):
    assert other_values(value) == pytest.approx((less, more))


def test_a_case_is_at_the_edge_where_something_is_open_that_does_not_follow_from_a_verdict():
    assert undecided([0.01, 0.98, 0.35])
    assert not undecided([0.01, 0.98, 0.02])
    assert not undecided([0.1, STRUCTURE_RIGHT])


def test_what_moves_farthest_may_be_what_is_said_in_one_of_two_only():
    one = Said((), {(0, "nothing"): 0.9, (0, "delay"): 0.1}, True)
    other = Said((), {(0, "nothing"): 0.7, (0, "stribeck"): 0.25}, True)
    assert one.farthest(other) == pytest.approx(0.25)
    assert one.farthest(one) == 0.0


def test_so_many_cases_of_a_class_are_taken():
    wanted = _Wanted(3, 2)
    for number, kind in enumerate("aaabc"):
        wanted.take(kind, number)
    assert wanted.taken == [0, 1, 3]


def test_what_is_known_by_its_arguments_is_made_once():
    known, made = Known(), []

    def fit(model, refine=False):
        made.append(model)
        return object()

    once = known.once(fit)
    same = [SimpleNamespace(terms=(SimpleNamespace(key="delay", constants=None),)) for _ in range(2)]
    assert once(same[0]) is once(same[1])
    assert once(same[0], refine=True) is not once(same[0])
    assert len(made) == 2
