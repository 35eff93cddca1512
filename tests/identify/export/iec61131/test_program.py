"""Branches that differ from call to call, and variables of functions, which begin anew in every call."""

from __future__ import annotations

import numpy as np
import pytest

from identify.export.iec61131.parser import Parser
from identify.export.iec61131.program import DiffersByCall, RunFault, Variable, new_frame
from tests.identify.export.iec61131.block_text import BLOCK, value_of

COUNTS = """FUNCTION ONCE : LREAL
VAR_INPUT
    X : LREAL;
END_VAR
VAR
    N : LREAL := 1.0;
END_VAR
N := N + X;
IF X > 0.0 THEN
    ONCE := N;
END_IF;
END_FUNCTION
"""


def test_a_function_s_variables_begin_anew_and_its_result_too():
    once = Parser(COUNTS, "f.st").units()["ONCE"]
    assert [once.call([x], "f.st") for x in (1.0, 1.0, -1.0)] == [2.0, 2.0, 0.0]
    assert once.call([np.array([1.0, -1.0, 2.0])], "f.st").tolist() == [2.0, 0.0, 3.0]


def test_branches_inside_branches_are_for_their_own_calls():
    inside = "IF Q[2] > 0.0 THEN Y := 1.0; ELSE Y := 2.0; END_IF;"
    body = f"Y := 0.0; IF Q[1] > 0.0 THEN {inside} ELSIF Q[2] > 0.0 THEN Y := 3.0; END_IF;"
    unit = Parser(BLOCK.format(body=body), "b.st").units()["B"]
    q = np.array([[1.0, 1.0], [1.0, -1.0], [-1.0, 1.0], [-1.0, -1.0]])
    frame = {**new_frame(unit.variables), "Q": list(q.T)}
    unit.run(frame, "b.st")
    assert frame["Y"][0].tolist() == [1.0, 2.0, 3.0, 0.0]
    assert [value_of(body, *row) for row in q.tolist()] == [1.0, 2.0, 3.0, 0.0]


def test_an_element_is_where_the_last_index_counts_fastest():
    table = Variable("T", "LREAL", ((0, 1), (-1, 1)), (0.0,) * 6, "VAR")
    assert [table.place((i, j)) for i in (0, 1) for j in (-1, 0, 1)] == list(range(6))
    assert table.place((np.array([1, 1]), 0)) == 4
    with pytest.raises(RunFault, match=r"index 2 of T is not within 0\.\.1"):
        table.place((2, 0))
    with pytest.raises(DiffersByCall):
        table.place((np.array([0, 1]), 0))
