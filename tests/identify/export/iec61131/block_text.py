"""A function block around some statements, and what they make of its output."""

from __future__ import annotations

import numpy as np

from identify.export.iec61131.function_block import FunctionBlock

BLOCK = """FUNCTION HALF : LREAL
VAR_INPUT
    X : LREAL;
END_VAR
HALF := X / 2.0;
END_FUNCTION
FUNCTION_BLOCK B
VAR_INPUT
    Q : ARRAY[1..2] OF LREAL;
END_VAR
VAR_OUTPUT
    Y : LREAL;
END_VAR
VAR
    A, B1 : LREAL;
    I, N : INT;
    STARTED : BOOL;
    SINGLE : REAL;
    LIST : ARRAY[0..1, -1..1] OF LREAL := [1.0, 2.0, 3.0, 4.0];
END_VAR
{body}
END_FUNCTION_BLOCK
"""


def value_of(body, *q):
    rows = np.array([q or (0.0, 0.0)], float)
    return float(FunctionBlock(BLOCK.format(body=body), "b.st").call({"Q": rows}, "Y")[0, 0])
