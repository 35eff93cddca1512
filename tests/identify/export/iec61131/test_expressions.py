"""Expressions have the values that the standard's precedence and functions give."""

from __future__ import annotations

import pytest

from tests.identify.export.iec61131.block_text import value_of


@pytest.mark.parametrize(
    ("expression", "value"),
    [
        ("2.0 + 3.0 * 4.0 - 6.0 / 3.0", 12.0),
        ("10.0 - 4.0 - 3.0", 3.0),
        ("16.0 / 4.0 / 2.0", 2.0),
        ("2.0 ** 3.0 ** 2.0", 64.0),
        ("-2.0 ** 2.0", 4.0),
        ("2.0 * -3.0", -6.0),
        ("17 / 5 + 17 MOD 5", 5.0),
        ("(0 - 17) / 5", -3.0),
        ("(0 - 17) MOD 5", -2.0),
        ("1_000 + 16#FF + 2#101", 1260.0),
        ("LREAL#1.5 + INT#2", 3.5),
        ("HALF(3.0) + half(1.0)", 2.0),
        ("EXPT(2.0, 10) + LOG(100.0) + LN(EXP(1.0))", 1027.0),
        ("MIN(1.0, 2.0) + MAX(1.0, 2.0) + LIMIT(0.0, 5.0, 3.0) + SEL(TRUE, 1.0, 7.0)", 13.0),
        ("ABS(-3.0) + SQRT(4.0) + SIN(0.0) + COS(0.0) + ATAN(0.0)", 6.0),
        ("LIST[0, -1] + LIST[1, -1] + LIST[1, 1]", 5.0),
        ("1.5E2", 150.0),
    ],
)
def test_expressions_have_the_values_of_the_standard(expression, value):
    assert value_of(f"Y := {expression};") == pytest.approx(value, rel=1e-15)


@pytest.mark.parametrize(
    ("condition", "holds"),
    [
        ("TRUE OR TRUE AND FALSE", True),
        ("TRUE XOR TRUE OR TRUE", True),
        ("NOT FALSE AND FALSE", False),
        ("1.0 < 2.0 = TRUE", True),
        ("1.0 + 1.0 >= 2.0 & 3 <> 4", True),
        ("NOT (1 = 1)", False),
    ],
)
def test_conditions_have_the_precedence_of_the_standard(condition, holds):
    assert value_of(f"IF {condition} THEN Y := 1.0; ELSE Y := 0.0; END_IF;") == float(holds)
