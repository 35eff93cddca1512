"""A function block of a text, called once for each sample."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np
from numpy.typing import NDArray

from identify.export.iec61131.parser import Parser
from identify.export.iec61131.program import (
    EARLIER,
    NONE,
    UNKNOWN,
    Cell,
    DiffersByCall,
    Element,
    Elements,
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

    Calls are computed together. Variables that keep what a call before left in them are found first: where that follows from the
    inputs of that call, or from what is known of still earlier calls, it is what all calls together left, set back by one. Where
    it follows from itself, the statements that it follows from are run call by call.
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
        self._written = NONE.union(*(statement.writes for statement in self.unit.body))
        self._kept: Elements = NONE
        self._looked = False

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
                if not self._looked:
                    look = slice(part.start, min(part.start + FIRST_LOOK, part.stop))
                    self._attempt(rows, look)
                    self._looked = True
                frame, after = self._attempt(rows, part)
                cells = [read(frame, output, place) for place in range(len(frame[output]))]
                break
            except KeepsState as state:
                self._kept |= {state.element}
            except DiffersByCall:
                return self._one_by_one(rows, part, output)
        length = part.stop - part.start
        for name, place in self._written:
            cell = frame[name][place]
            if cell is not EARLIER:
                self._variables[name][place] = _last(cell)
        for (name, place), cell in after.items():
            self._variables[name][place] = cell
        return np.column_stack([np.broadcast_to(np.asarray(cell, float), (length,)) for cell in cells])

    def _attempt(self, rows: Mapping[str, list[Array]], part: slice) -> tuple[Frame, Mapping[Element, Cell]]:
        """The frame after these calls, all of them at once, and the kept elements after the last.

        Raises KeepsState: an element is read that is not yet known to be kept.
        """
        before, after = self._kept_before_each(rows, part)
        frame = self._frame(rows, part, before)
        self.unit.run(frame, self.source)
        return frame, after

    def _frame(self, rows: Mapping[str, list[Array]], part: slice, before: Mapping[Element, Array]) -> Frame:
        """The frame before some calls: what was left before them is known of the elements `before` alone."""
        frame: Frame = {name: list(cells) for name, cells in self._variables.items()}
        for name, place in self._written:
            frame[name][place] = EARLIER
        for (name, place), values in before.items():
            frame[name][place] = values
        for name, columns in rows.items():
            frame[name] = [self._given(name, column[part]) for column in columns]
        return frame

    def _given(self, name: str, values: Value) -> Cell:
        kind = self.unit.variables[name].kind
        return values != 0 if kind == "BOOL" else held(values, kind)

    def _kept_before_each(
        self, rows: Mapping[str, list[Array]], part: slice
    ) -> tuple[Mapping[Element, Array], Mapping[Element, Cell]]:
        """Values of the kept elements before each of some calls, and after the last."""
        before: dict[Element, Array] = {}
        last: dict[Element, Cell] = {}
        while True:
            self._set_back(rows, part, before, last)
            left = self._kept - before.keys()
            if not left:
                return before, last
            # what follows from itself and from the least beside it; others may follow from that
            needed = min(
                (self._what_follow_from(frozenset({element}))[1] & left for element in sorted(left)), key=len
            )
            self._call_by_call(needed, rows, part, before, last)

    def _call_by_call(
        self,
        wanted: Elements,
        rows: Mapping[str, list[Array]],
        part: slice,
        before: dict[Element, Array],
        last: dict[Element, Cell],
    ) -> None:
        """Find values of kept elements before each of some calls, and after the last, one call after the other."""
        body, needed = self._what_follow_from(wanted)
        frame: Frame = {name: list(cells) for name, cells in self._variables.items()}
        history: dict[Element, list[Cell]] = {element: [] for element in wanted}
        given = {(name, place): rows[name][place][part].tolist() for name, place in needed if name in rows}
        for call in range(part.stop - part.start):
            for (name, place), values in given.items():
                frame[name][place] = self._given(name, values[call])
            for (name, place), values in history.items():
                values.append(frame[name][place])
            run_all(body, frame, None, self.source)
        before |= {element: np.array(values) for element, values in history.items()}
        last |= {(name, place): frame[name][place] for name, place in wanted}

    def _set_back(
        self,
        rows: Mapping[str, list[Array]],
        part: slice,
        before: dict[Element, Array],
        last: dict[Element, Cell],
    ) -> None:
        """Find the same of kept elements that follow from inputs and from what is found; further ones show on the way."""
        length = part.stop - part.start
        while True:
            frame = self._frame(rows, part, before)
            kept: set[Element] = set()
            for statement in self.unit.body:
                try:
                    run_all([statement], frame, None, self.source)
                except KeepsState as state:
                    name, place = state.element
                    if frame[name][place] is not UNKNOWN:
                        kept.add(state.element)
                    for name, place in statement.writes:
                        frame[name][place] = UNKNOWN
            new = kept - self._kept
            self._kept |= new
            settled = [
                (name, place)
                for name, place in self._kept - before.keys()
                if frame[name][place] is not UNKNOWN and frame[name][place] is not EARLIER
            ]
            for name, place in settled:
                after = np.broadcast_to(np.asarray(frame[name][place]), (length,))
                first = np.asarray(self._variables[name][place])
                before[name, place] = np.concatenate([first[None], after[:-1]]).astype(after.dtype)
                last[name, place] = after[-1].item()
            if not (new or settled):
                return

    def _what_follow_from(self, needed: Elements) -> tuple[Sequence[Statement], Elements]:
        """The statements that give some elements their values, and those that these need; and all that they read."""
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
