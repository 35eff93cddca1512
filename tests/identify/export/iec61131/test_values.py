"""Types of structured text: what becomes what by itself, and how a type holds a value."""

from __future__ import annotations

import numpy as np
import pytest

from identify.export.iec61131.values import (
    LITERAL,
    STANDARD,
    TypeFault,
    arithmetic,
    common,
    fits,
    held,
    result_kind,
)


@pytest.mark.parametrize(
    ("kind", "target", "by_itself"),
    [
        ("INT", "LREAL", True),
        ("INT", "REAL", True),
        ("DINT", "REAL", False),
        ("DINT", "LREAL", True),
        ("LINT", "LREAL", False),
        ("REAL", "LREAL", True),
        ("LREAL", "REAL", False),
        ("LREAL", "INT", False),
        ("USINT", "INT", True),
        ("SINT", "UINT", False),
        ("BOOL", "INT", False),
        (LITERAL, "LREAL", True),
        (LITERAL, "BOOL", False),
    ],
)
def test_a_value_becomes_one_of_a_wider_type_by_itself_and_no_other(kind, target, by_itself):
    assert fits(kind, target) is by_itself


def test_two_numbers_are_computed_in_the_wider_type():
    assert common("INT", "LREAL") == common("LREAL", "REAL") == "LREAL"
    assert common(LITERAL, "INT") == "INT"
    for pair in (("LINT", "LREAL"), ("BOOL", "INT")):
        with pytest.raises(TypeFault):
            common(*pair)


def test_single_precision_is_rounded_each_time_and_integers_are_kept_within_their_range():
    assert arithmetic("+", "REAL")(0.1, 0.2) == float(np.float32(0.1 + 0.2))
    assert held(np.array([0.1]), "REAL")[0] == float(np.float32(0.1))
    assert held(255, "USINT") == 255
    for value, kind in ((256, "USINT"), (-1, "UINT"), (np.array([0, 40000]), "INT")):
        with pytest.raises(TypeFault, match="beyond the range"):
            held(value, kind)


def test_quotients_of_integers_are_rounded_towards_zero_also_for_samples():
    seven = np.array([7, -7, 7, -7])
    two = np.array([2, 2, -2, -2])
    assert arithmetic("/", "INT")(seven, two).tolist() == [3, -3, -3, 3]
    assert arithmetic("MOD", "INT")(seven, two).tolist() == [1, -1, 1, -1]


def test_functions_compute_samples_as_they_compute_one_value():
    x = np.array([0.3, 0.7])
    for name, function in STANDARD.items():
        if function.arguments == ("real",):
            assert function.compute(x) == pytest.approx(
                [function.compute(value) for value in x.tolist()], rel=1e-14
            ), name
    assert STANDARD["LN"].compute(0.0) == -np.inf
    assert result_kind(STANDARD["EXPT"], ("REAL", "LREAL")) == "REAL"
    assert result_kind(STANDARD["MAX"], ("INT", "LREAL")) == "LREAL"
