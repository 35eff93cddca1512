"""What the units of a structured text do, on one call or on as many calls at once as there are samples.

A frame holds the values of a unit's variables. In a frame of many calls a value that differs from call to call is an
array (N,), and where calls take different branches of IF, a mask (N,) says which of them a statement is for.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from identify.export.iec61131.values import TypeFault, Value, held

Mask = NDArray[np.bool_] | None
"""which of the calls a statement is for; None for all"""


Element = tuple[str, int]
"""name of a variable and where in it an element is held; 0 of a single value"""
Elements = frozenset[Element]
NONE: Elements = frozenset()


class KeepsState(Exception):
    """An element is read that still has the value of the call before."""

    def __init__(self, element: Element) -> None:
        super().__init__(element)
        self.element = element


class DiffersByCall(Exception):
    """The calls need different places of an array, or numbers of turns of a loop, so that they cannot be computed at once."""


class RunFault(Exception):
    """What a text did that it must not, in words."""


class _Earlier:
    """Stands for a value of the call before."""


EARLIER = _Earlier()
UNKNOWN = _Earlier()
"""of a value that follows from one of the call before"""
Cell = Value | _Earlier


@dataclass(frozen=True)
class Variable:
    """A declared variable.

    kind    : elementary type, of an array that of its elements
    bounds  : lowest and highest index in each dimension; none for a single value
    initial : values of the elements, the last index counting fastest
    section : VAR, VAR_INPUT, VAR_OUTPUT or VAR_TEMP
    """

    name: str
    kind: str
    bounds: tuple[tuple[int, int], ...]
    initial: tuple[Value, ...]
    section: str
    constant: bool = False

    def elements(self) -> Elements:
        """All of them."""
        return frozenset((self.name, place) for place in range(len(self.initial)))

    def place(self, index: Sequence[Value]) -> int:
        """Where an element is held.

        Raises RunFault: there is no such element. DiffersByCall: it is another one for other calls.
        """
        place = 0
        for value, (low, high) in zip(index, self.bounds, strict=True):
            if isinstance(value, np.ndarray):
                if np.ptp(value):
                    raise DiffersByCall
                value = int(value.flat[0])
            if not low <= value <= high:
                raise RunFault(f"index {value} of {self.name} is not within {low}..{high}")
            place = place * (high - low + 1) + int(value) - low
        return place


Frame = dict[str, list[Cell]]
"""values of a unit's variables, element by element"""


def new_frame(variables: Mapping[str, Variable]) -> Frame:
    """Of a unit that was never called."""
    return {name: list(variable.initial) for name, variable in variables.items()}


@dataclass(frozen=True)
class Expression:
    """Something with a value: its type, how it is computed, and the elements that it reads."""

    kind: str
    value: Callable[[Frame], Value]
    reads: Elements = NONE


@dataclass(frozen=True)
class Statement:
    """What it does to a frame, and the elements that it may read and write."""

    line: int
    run: Callable[[Frame, Mask], None]
    reads: Elements
    writes: Elements


@dataclass
class Unit:
    """A function or a function block; `kind` is the type of a function's result, None for a block."""

    name: str
    kind: str | None
    variables: dict[str, Variable] = field(default_factory=dict)
    body: list[Statement] = field(default_factory=list)

    def of_section(self, section: str) -> list[Variable]:
        """The variables of a section, in their order."""
        return [variable for variable in self.variables.values() if variable.section == section]

    def run(self, frame: Frame, source: str) -> None:
        """All statements on a frame.

        Raises RunFault: with file and line.
        """
        run_all(self.body, frame, None, source)

    def call(self, arguments: Sequence[Value], source: str) -> Value:
        """A function's result; its variables begin anew in every call (6.6.2.2)."""
        frame = new_frame(self.variables)
        for variable, value in zip(self.of_section("VAR_INPUT"), arguments, strict=True):
            frame[variable.name] = [held(value, variable.kind)]
        self.run(frame, source)
        return read(frame, self.name, 0)


def run_all(body: Sequence[Statement], frame: Frame, mask: Mask, source: str) -> None:
    """Statements one after the other.

    Raises RunFault: with file and line.
    """
    for statement in body:
        try:
            statement.run(frame, mask)
        except (RunFault, TypeFault) as fault:
            if str(fault).startswith(source):
                raise
            raise RunFault(f"{source} line {statement.line}: {fault}") from None


def read(frame: Frame, name: str, place: int) -> Value:
    """The value of an element.

    Raises KeepsState: it is that of the call before.
    """
    value = frame[name][place]
    if isinstance(value, _Earlier):
        raise KeepsState((name, place))
    return value


def assign(frame: Frame, variable: Variable, place: int, value: Value, mask: Mask) -> None:
    """Give an element a value, in the calls of a mask.

    Raises KeepsState: the other calls keep what they had in the call before.
    """
    new = held(value, variable.kind)
    if mask is not None:
        new = np.where(mask, new, read(frame, variable.name, place))
    frame[variable.name][place] = new


Branch = tuple[Expression, Sequence[Statement]]


def choose(
    branches: Sequence[Branch], otherwise: Sequence[Statement], frame: Frame, mask: Mask, source: str
) -> None:
    """IF: the first branch whose condition holds."""
    left = mask
    for condition, body in branches:
        holds = condition.value(frame)
        if not isinstance(holds, np.ndarray):
            if holds:
                run_all(body, frame, left, source)
                return
            continue
        chosen = holds if left is None else left & holds
        if chosen.any():
            run_all(body, frame, None if chosen.all() else chosen, source)
        left = ~holds if left is None else left & ~holds
        if not left.any():
            return
    run_all(otherwise, frame, left, source)


def count(
    variable: Variable,
    limits: tuple[Expression, Expression, Expression],
    body: Sequence[Statement],
    frame: Frame,
    mask: Mask,
    source: str,
) -> None:
    """FOR: first, last and step are computed once, before the loop (7.3.3.4.2)."""
    first, last, step = (_alike(limit.value(frame)) for limit in limits)
    if step == 0:
        raise RunFault(f"FOR {variable.name}: the step is 0")
    value = first
    while value <= last if step > 0 else value >= last:
        assign(frame, variable, 0, value, None)
        run_all(body, frame, mask, source)
        value += step


def _alike(value: Value) -> int:
    """A value that is the same for all calls. Raises DiffersByCall: it is not."""
    if isinstance(value, np.ndarray):
        if np.ptp(value):
            raise DiffersByCall
        return int(value.flat[0])
    return int(value)
