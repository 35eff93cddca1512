"""Types, operators and standard functions of structured text, on one value or on one for each sample.

A value that differs from sample to sample is an array (N,); all others are plain numbers. The rules are those of
IEC 61131-3, third edition: 6.4 (types), 6.6.1.6 (which types become which by themselves), 6.6.2.5 (standard functions),
7.3.2 (operators).
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

Value = float | NDArray[Any]
"""truth values and integers are numbers too"""

INTEGERS: Mapping[str, int] = {
    "SINT": 8, "INT": 16, "DINT": 32, "LINT": 64, "USINT": 8, "UINT": 16, "UDINT": 32, "ULINT": 64,
}  # fmt: skip
"""bits of each type of integers; those with U have no sign"""
LITERAL = "an integer literal"
"""type of an integer as it is written, which fits every numerical type"""
REALS = ("REAL", "LREAL")
TYPES = ("BOOL", *INTEGERS, *REALS)


class TypeFault(Exception):
    """What is wrong with the types, in words."""


def is_number(kind: str) -> bool:
    """Whether values of a type can be computed with."""
    return kind in INTEGERS or kind in REALS or kind == LITERAL


def is_integer(kind: str) -> bool:
    """Whether values of a type can count and index."""
    return kind in INTEGERS or kind == LITERAL


def fits(kind: str, target: str) -> bool:
    """Whether a value of a type may be assigned to a variable of another without a conversion that is written out."""
    if kind == target:
        return True
    if kind == LITERAL:
        return is_number(target)
    if kind in INTEGERS:
        if target == "LREAL":
            return INTEGERS[kind] <= 32
        if target == "REAL":
            return INTEGERS[kind] <= 16
        return (
            target in INTEGERS
            and _range(target)[0] <= _range(kind)[0]
            and _range(kind)[1] <= _range(target)[1]
        )
    return (kind, target) == ("REAL", "LREAL")


def common(left: str, right: str) -> str:
    """The type that two numbers are computed in.

    Raises TypeFault: there is none.
    """
    if not (is_number(left) and is_number(right)):
        raise TypeFault(f"{left} and {right} are not both numbers")
    for kind, other in ((left, right), (right, left)):
        if fits(kind, other):
            return other
    raise TypeFault(f"{left} and {right} have no common type")


def held(value: Value, kind: str) -> Value:
    """A value as a variable of a type holds it.

    Raises TypeFault: it is beyond the type's range.
    """
    if kind == "REAL":
        return (
            value.astype(np.float32).astype(np.float64)
            if isinstance(value, np.ndarray)
            else float(np.float32(value))
        )
    if kind == "LREAL":
        return value.astype(np.float64) if isinstance(value, np.ndarray) else float(value)
    if kind in INTEGERS:
        low, high = _range(kind)
        if not (low <= np.min(value) and np.max(value) <= high):
            raise TypeFault(f"{value} is beyond the range of {kind}")
    return value


def _range(kind: str) -> tuple[int, int]:
    bits = INTEGERS[kind]
    return (0, 2**bits - 1) if kind.startswith("U") else (-(2 ** (bits - 1)), 2 ** (bits - 1) - 1)


@dataclass(frozen=True)
class StandardFunction:
    """A function of the standard.

    arguments : types, "real" for REAL or LREAL, "number" for any, "BOOL"; the result is of the numbers' type
    compute   : of values
    """

    arguments: tuple[str, ...]
    compute: Callable[..., Value]


def _of_numbers(exact: Callable[..., float], vectorised: Callable[..., NDArray]) -> Callable[..., Value]:
    """A function of one value by `math`, of samples by NumPy; where `math` has no answer (LN of 0) the arithmetic's is given."""

    def compute(*values: Value) -> Value:
        if not _differ(*values):
            try:
                return exact(*values)
            except (ValueError, OverflowError, ZeroDivisionError):
                pass
        with np.errstate(all="ignore"):
            result = vectorised(*(np.asarray(value, dtype=np.float64) for value in values))
        return result if result.ndim else float(result)

    return compute


def _chosen(which: Value, if_false: Value, if_true: Value) -> Value:
    return (
        np.where(which, if_true, if_false)
        if isinstance(which, np.ndarray)
        else (if_true if which else if_false)
    )


def _lowest(one: Value, other: Value) -> Value:
    return np.minimum(one, other) if _differ(one, other) else min(one, other)


def _highest(one: Value, other: Value) -> Value:
    return np.maximum(one, other) if _differ(one, other) else max(one, other)


def _differ(*values: Value) -> bool:
    """Whether a value differs from sample to sample."""
    return any(isinstance(value, np.ndarray) for value in values)


STANDARD: Mapping[str, StandardFunction] = {
    "ABS": StandardFunction(("number",), lambda value: abs(value)),
    **{
        name: StandardFunction(("real",), _of_numbers(exact, vectorised))
        for name, exact, vectorised in (
            ("SQRT", math.sqrt, np.sqrt),
            ("LN", math.log, np.log),
            ("LOG", math.log10, np.log10),
            ("EXP", math.exp, np.exp),
            ("SIN", math.sin, np.sin),
            ("COS", math.cos, np.cos),
            ("TAN", math.tan, np.tan),
            ("ASIN", math.asin, np.arcsin),
            ("ACOS", math.acos, np.arccos),
            ("ATAN", math.atan, np.arctan),
        )
    },
    "EXPT": StandardFunction(("real", "number"), _of_numbers(math.pow, np.power)),
    "MIN": StandardFunction(("number", "number"), _lowest),
    "MAX": StandardFunction(("number", "number"), _highest),
    "LIMIT": StandardFunction(
        ("number", "number", "number"), lambda low, value, high: _lowest(_highest(value, low), high)
    ),
    "SEL": StandardFunction(("BOOL", "number", "number"), _chosen),
}


def _quotient(left: Value, right: Value) -> Value:
    return _of_numbers(lambda a, b: a / b, np.divide)(left, right)


def _whole_quotient(left: Value, right: Value) -> Value:
    """Of integers, rounded towards zero (7.3.2, table 71)."""
    if np.any(np.equal(right, 0)):
        raise TypeFault("an integer is divided by 0")
    size = abs(left) // abs(right)
    return (
        size * np.sign(left) * np.sign(right)
        if isinstance(size, np.ndarray)
        else size * (-1 if (left < 0) != (right < 0) else 1)
    )


def arithmetic(sign: str, kind: str) -> Callable[[Value, Value], Value]:
    """What an operator does with two numbers of a type; REAL is rounded to its own precision each time."""
    operators: Mapping[str, Callable[[Value, Value], Value]] = {
        "+": lambda a, b: a + b,
        "-": lambda a, b: a - b,
        "*": lambda a, b: a * b,
        "/": _whole_quotient if is_integer(kind) else _quotient,
        "MOD": lambda a, b: a - b * _whole_quotient(a, b),
        "**": STANDARD["EXPT"].compute,
    }
    operator = operators[sign]
    return (lambda a, b: held(operator(a, b), "REAL")) if kind == "REAL" else operator


COMPARISONS: Mapping[str, Callable[[Value, Value], Value]] = {
    "<": lambda a, b: a < b,
    ">": lambda a, b: a > b,
    "<=": lambda a, b: a <= b,
    ">=": lambda a, b: a >= b,
    "=": lambda a, b: a == b,
    "<>": lambda a, b: a != b,
}


def logic(sign: str) -> Callable[[Value, Value], Value]:
    """AND, OR and XOR of truth values."""
    vectorised = {"AND": np.logical_and, "OR": np.logical_or, "XOR": np.logical_xor}[sign]

    def compute(left: Value, right: Value) -> Value:
        result = vectorised(left, right)
        return result if result.ndim else bool(result)

    return compute


def opposite(value: Value) -> Value:
    """NOT of a truth value."""
    return np.logical_not(value) if isinstance(value, np.ndarray) else not value


def result_kind(function: StandardFunction, kinds: Sequence[str]) -> str:
    """The type of a standard function's result.

    Raises TypeFault: the arguments are of the wrong number or types.
    """
    if len(kinds) != len(function.arguments):
        raise TypeFault(f"takes {len(function.arguments)} values and got {len(kinds)}")
    numbers: list[str] = []
    for wanted, kind in zip(function.arguments, kinds, strict=True):
        if wanted == "BOOL":
            if kind != "BOOL":
                raise TypeFault(f"wants BOOL and got {kind}")
        elif not (kind in REALS if wanted == "real" else is_number(kind)):
            raise TypeFault(f"wants {'REAL or LREAL' if wanted == 'real' else 'a number'} and got {kind}")
        else:
            numbers.append(kind)
    kind = numbers[0]
    if function is not STANDARD["EXPT"]:  # its exponent may be of any type
        for other in numbers[1:]:
            kind = common(kind, other)
    return kind
