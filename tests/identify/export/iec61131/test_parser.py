"""Statements do what the standard says; a text that is wrong is refused in one line with file and line."""

from __future__ import annotations

import math

import numpy as np
import pytest

from identify.export.iec61131.function_block import FunctionBlock
from identify.recording import InputError
from tests.identify.export.iec61131.block_text import BLOCK, value_of


def test_loops_cases_and_single_precision():
    assert value_of("FOR I := 3 TO 1 BY -1 DO Y := Y * 10.0 + I; END_FOR;") == 321.0
    case = "N := {n}; CASE N OF 1: Y := 1.0; 2, 4..6: Y := 2.0; ELSE Y := 3.0; END_CASE;"
    assert [value_of(case.format(n=n)) for n in (1, 2, 3, 5)] == [1.0, 2.0, 3.0, 2.0]
    assert value_of("SINGLE := REAL#0.1; Y := SINGLE;") == float(np.float32(0.1))
    assert math.isinf(value_of("Y := 1.0 / Q[1];"))


@pytest.mark.parametrize(
    ("body", "said"),
    [
        ("Y := 1.0", "';' was to stand here and not 'END_FUNCTION_BLOCK'"),
        ("Y := Z;", "no variable or function 'Z'"),
        ("Y = 1.0;", "':=' was to stand here"),
        ("N := 1.5;", "LREAL, which does not become INT"),
        ("SINGLE := 1.5;", "LREAL, which does not become REAL"),
        ("Y := TRUE;", "BOOL, which does not become LREAL"),
        ("Y := SIN(1);", "SIN wants REAL or LREAL and got an integer literal"),
        ("Y := HALF(1.0, 2.0);", "HALF wants (LREAL) and got (LREAL, LREAL)"),
        ("IF 1.0 THEN Y := 1.0; END_IF;", "a condition is BOOL"),
        ("IF TRUE THEN Y := 1.0;", "'END_FUNCTION_BLOCK' stands where it cannot"),
        ("Y := LIST[0];", "LIST has 2 indices, and 1 stand here"),
        ("Y := LIST[0, 2];", "index 2 of LIST is not within -1..1"),
        ("Y := Q[0];", "index 0 of Q is not within 1..2"),
        ("Y := 2.0 - -1.0 +;", "a value was to stand here and not ';'"),
        ("Y := - -1.0;", "two signs stand one behind the other"),
        ("Y := 1.0.5;", "'.5;"),
        ("Y := 1.5x;", "'1.5x' is no number"),
        ("WHILE TRUE DO Y := 1.0; END_WHILE;", "a part of the language that is not read here"),
        ("Y := A__B;", "double underscore"),
        ("Y := A_;", "underscore"),
        ("Y := 1.0; (* begun", "a comment that begins here does not end"),
        ("Y := $1;", "is not structured text"),
        ("FOR I := 0 TO 3 DO I := 2; END_FOR;", "written to inside its own loop"),
        ("N := 32767; N := N + 1;", "beyond the range of INT"),
        ("N := 1 / N;", "an integer is divided by 0"),
    ],
)
def test_a_wrong_text_is_said_in_one_line_with_file_and_line(body, said):
    with pytest.raises(InputError) as refused:
        value_of(body)
    assert str(refused.value).startswith("b.st line 2")
    assert said in str(refused.value)
    assert "\n" not in str(refused.value)


def test_a_name_that_is_a_word_of_the_language_is_refused():
    with pytest.raises(InputError, match="a name was to stand here and not 'IF'"):
        FunctionBlock(BLOCK.format(body="").replace("A, B1", "IF, B1"), "b.st")
    with pytest.raises(InputError, match="there are 0 function blocks"):
        FunctionBlock("FUNCTION F : LREAL\nF := 1.0;\nEND_FUNCTION\n", "f.st")
