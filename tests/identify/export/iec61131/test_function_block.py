"""Many calls computed together, with what stays from call to call."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from identify.export.iec61131 import function_block
from identify.export.iec61131.function_block import FunctionBlock
from identify.recording import InputError
from tests.identify.export.iec61131.block_text import BLOCK

REMEMBERS = """
IF STARTED THEN
    IF Q[1] > 0.0 THEN A := A + Q[2]; ELSIF Q[1] < -1.0 THEN A := -A; END_IF;
    B1 := HALF(B1) + A;
ELSE
    A := Q[1];
END_IF;
STARTED := TRUE;
N := (N + 1) MOD 5;
FOR I := 0 TO 1 DO
    LIST[I, 0] := A * Q[1] + I;
END_FOR;
Y := LIST[0, 0] + LIST[1, 0] + B1 + N + LIST[0, 1];
IF Q[2] > 0.5 THEN LIST[0, 1] := Q[1]; END_IF;
"""


@settings(max_examples=20, deadline=None)
@given(st.integers(0, 2**32 - 1), st.integers(1, 30))
def test_calls_that_are_computed_together_are_those_computed_one_by_one(seed, count):
    """States that are found by the reader, in branches that differ from call to call, over the edge of a part."""
    q = np.random.default_rng(seed).normal(size=(count, 2))
    single = FunctionBlock(BLOCK.format(body=REMEMBERS), "b.st")
    expected = [single.call({"Q": row[None]}, "Y")[0, 0] for row in q]
    with pytest.MonkeyPatch.context() as patched:
        patched.setattr(function_block, "AT_ONCE", 7)
        together = FunctionBlock(BLOCK.format(body=REMEMBERS), "b.st").call({"Q": q}, "Y")[:, 0]
    assert together == pytest.approx(expected, rel=1e-12, abs=1e-12)


def test_an_index_that_differs_from_call_to_call_is_followed_one_by_one():
    body = "N := 0; IF Q[1] > 0.0 THEN N := 1; END_IF; Y := LIST[N, 0];"
    q = np.array([[1.0, 0.0], [-1.0, 0.0], [2.0, 0.0]])
    found = FunctionBlock(BLOCK.format(body=body), "b.st").call({"Q": q}, "Y")[:, 0]
    assert found.tolist() == [0.0, 2.0, 0.0]


def test_inputs_and_outputs_that_there_are_not_are_refused():
    block = FunctionBlock(BLOCK.format(body="Y := Q[1];"), "b.st")
    for inputs, output, message in (
        ({"Z": np.zeros((1, 1))}, "Y", "b.st: there is no input Z"),
        ({"A": np.zeros((1, 1))}, "Y", "b.st: there is no input A"),
        ({"Q": np.zeros((1, 3))}, "Y", "b.st: Q has 2 elements and not 3"),
        ({"Q": np.zeros((1, 2))}, "A", "b.st: there is no output A"),
    ):
        with pytest.raises(InputError) as refused:
            block.call(inputs, output)
        assert str(refused.value) == message
