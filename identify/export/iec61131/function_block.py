"""A function block of a text, called once for each sample."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np
from numpy.typing import NDArray

from identify.export.iec61131.parser import Parser
from identify.export.iec61131.program import (
    EARLIER,
    Cell,
    DiffersByCall,
    Frame,
    KeepsState,
    RunFault,
    Statement,
    Unit,
    new_frame,
    read,
    run_all,
)
from identify.export.iec61131.values import Value, held
from identify.recording.errors import InputError

Array = NDArray[np.float64]

AT_ONCE = 8192
"""calls that are computed together: their values stay in the processor's cache"""
FIRST_LOOK = 3
"""calls by which the variables are found that keep their values"""


class FunctionBlock:
    """The block of a text and its own variables, which stay from call to call.

    Calls are computed together. Where some variables keep what a call before left in them, the statements that these follow from
    are run call by call, and all others together.
    """

    def __init__(self, text: str, source: str) -> None:
        """The one function block of a text; `source` is the file's name, for messages.

        Raises InputError: with file and line, the text is not structured text; or it has not one function block.
        """
        blocks = [unit for unit in Parser(text, source).units().values() if unit.kind is None]
        if len(blocks) != 1:
            raise InputError(f"{source}: there are {len(blocks)} function blocks and not one")
        self.unit: Unit = blocks[0]
        self.source = source
        self._variables = new_frame(self.unit.variables)
        self._written = frozenset[str]().union(*(statement.writes for statement in self.unit.body))
        self._kept: frozenset[str] = frozenset()

    def inputs(self) -> list[str]:
        """Names of the inputs."""
        return [variable.name for variable in self.unit.of_section("VAR_INPUT")]

    def call(self, inputs: Mapping[str, Array], output: str) -> Array:
        """(N, m) elements of an output after each of N calls.

        inputs : by name (N, elements); those that are left out keep their values
        Raises InputError: there is no such input or output, or the text does what it must not.
        """
        calls = {len(values) for values in inputs.values()}
        (count,) = calls  # as many of each
        rows = {name: self._columns(name, values) for name, values in inputs.items()}
        if output not in {variable.name for variable in self.unit.of_section("VAR_OUTPUT")}:
            raise InputError(f"{self.source}: there is no output {output}")
        elements = len(self._variables[output])
        outputs = np.empty((count, elements))
        try:
            with np.errstate(all="ignore"):
                for start in range(0, count, AT_ONCE):
                    part = slice(start, min(start + AT_ONCE, count))
                    outputs[part] = self._together(rows, part, output)
        except RunFault as fault:
            raise InputError(str(fault)) from None
        return outputs

    def _columns(self, name: str, values: Array) -> list[Array]:
        variable = self.unit.variables.get(name)
        if variable is None or variable.section != "VAR_INPUT":
            raise InputError(f"{self.source}: there is no input {name}")
        columns = np.reshape(values, (len(values), -1))
        if columns.shape[1] != len(variable.initial):
            raise InputError(
                f"{self.source}: {name} has {len(variable.initial)} elements and not {columns.shape[1]}"
            )
        return [np.ascontiguousarray(column, float) for column in columns.T]

    def _together(self, rows: Mapping[str, list[Array]], part: slice, output: str) -> Array:
        """The output in some calls, after which the variables are those of the last one."""
        while True:
            try:
                if not self._kept:
                    look = slice(part.start, min(part.start + FIRST_LOOK, part.stop))
                    self._attempt(rows, look)
                frame, after = self._attempt(rows, part)
                break
            except KeepsState as state:
                self._kept |= {state.variable}
            except DiffersByCall:
                return self._one_by_one(rows, part, output)
        length = part.stop - part.start
        columns = [np.broadcast_to(np.asarray(cell, float), (length,)) for cell in frame[output]]
        for name in self._written:
            self._variables[name] = [_last(cell) for cell in frame[name]]
        self._variables |= after
        return np.column_stack(columns)

    def _attempt(self, rows: Mapping[str, list[Array]], part: slice) -> tuple[Frame, Frame]:
        """The frame after these calls, all of them at once, and the kept variables after the last.

        Raises KeepsState: a variable is read that is not yet known to be kept.
        """
        before, after = self._kept_before_each(rows, part)
        frame: Frame = {}
        for name, cells in self._variables.items():
            if name in rows:
                frame[name] = [self._given(name, column[part]) for column in rows[name]]
            elif name in before:
                frame[name] = before[name]
            else:
                frame[name] = [EARLIER] * len(cells) if name in self._written else list(cells)
        self.unit.run(frame, self.source)
        return frame, after

    def _given(self, name: str, values: Value) -> Cell:
        return held(values, self.unit.variables[name].kind)

    def _kept_before_each(self, rows: Mapping[str, list[Array]], part: slice) -> tuple[Frame, Frame]:
        """Values of the kept variables before each of some calls, and after the last."""
        if not self._kept:
            return {}, {}
        body, needed = self._what_they_follow_from()
        frame: Frame = {name: list(cells) for name, cells in self._variables.items()}
        history: dict[str, list[list[Cell]]] = {name: [] for name in self._kept}
        columns = {name: [column[part].tolist() for column in rows[name]] for name in needed if name in rows}
        by_call = {name: list(zip(*given, strict=True)) for name, given in columns.items()}
        for call in range(part.stop - part.start):
            for name, given in by_call.items():
                frame[name] = [self._given(name, value) for value in given[call]]
            for name, kept in history.items():
                kept.append(list(frame[name]))
            run_all(body, frame, None, self.source)
        before: Frame = {
            name: [np.array(cells) for cells in zip(*kept, strict=True)] for name, kept in history.items()
        }
        return before, {name: list(frame[name]) for name in self._kept}

    def _what_they_follow_from(self) -> tuple[Sequence[Statement], frozenset[str]]:
        """The statements that give the kept variables their values, and those that these need; and all that they read."""
        needed = self._kept
        while True:
            body = [statement for statement in self.unit.body if statement.writes & needed]
            wider = needed.union(*(statement.reads for statement in body))
            if wider == needed:
                return body, needed
            needed = wider

    def _one_by_one(self, rows: Mapping[str, list[Array]], part: slice, output: str) -> Array:
        """The output in some calls, each computed by itself."""
        outputs: list[list[float]] = []
        elements = len(self._variables[output])
        for row in range(part.start, part.stop):
            for name, columns in rows.items():
                self._variables[name] = [self._given(name, float(column[row])) for column in columns]
            self.unit.run(self._variables, self.source)
            outputs.append([float(read(self._variables, output, each)) for each in range(elements)])
        return np.array(outputs)


def _last(cell: Cell) -> Cell:
    """Of a value for each call that of the last one."""
    return cell[-1].item() if isinstance(cell, np.ndarray) else cell
