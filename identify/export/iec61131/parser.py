"""The grammar of structured text: declarations and statements of functions and function blocks (IEC 61131-3, 6.5, 6.6, 7.3)."""

from __future__ import annotations

from collections.abc import Callable, Sequence

from identify.export.iec61131.expressions import ExpressionParser
from identify.export.iec61131.program import (
    NONE,
    Branch,
    Expression,
    Frame,
    Statement,
    Unit,
    Variable,
    assign,
    choose,
    count,
    new_frame,
)
from identify.export.iec61131.values import (
    COMPARISONS,
    TYPES,
    TypeFault,
    Value,
    fits,
    held,
    is_integer,
    logic,
)

SECTIONS = ("VAR", "VAR_INPUT", "VAR_OUTPUT", "VAR_TEMP")


class Parser(ExpressionParser):
    """Of one text. Functions stand above what calls them."""

    def units(self) -> dict[str, Unit]:
        """The functions and function blocks of the text, by name.

        Raises InputError: with file and line, where the text is not what the standard says, or more of it than is read here.
        """
        while self.at.kind != "end":
            if self.at.text not in ("FUNCTION", "FUNCTION_BLOCK"):
                raise self.wrong(f"FUNCTION or FUNCTION_BLOCK was to stand here and not '{self.at.text}'")
            self._unit(self.take().text)
        return self.known

    def _unit(self, word: str) -> None:
        name = self.new_name(self.known)
        kind = None
        if word == "FUNCTION":
            self.take(":")
            kind = self._type()
        self.unit = Unit(name, kind)
        if kind is not None:
            self._declare([name], kind, (), None, "RESULT", False)
        while self.at.text in SECTIONS:
            self._section()
        self.unit.body = self._statements(f"END_{word}")
        self.take(f"END_{word}")
        self.known[name] = self.unit

    def _section(self) -> None:
        section = self.take().text
        constant = self.took("CONSTANT")
        while not self.took("END_VAR"):
            names = [self.new_name(self.unit.variables)]
            while self.took(","):
                names.append(self.new_name({*self.unit.variables, *names}))
            self.take(":")
            bounds: list[tuple[int, int]] = []
            if self.took("ARRAY"):
                self.take("[")
                bounds.append(self._bounds())
                while self.took(","):
                    bounds.append(self._bounds())
                self.take("]")
                self.take("OF")
            kind = self._type()
            initial = None
            if self.took(":="):
                initial = self._initial(kind, bool(bounds))
            self._declare(names, kind, tuple(bounds), initial, section, constant)
            self.take(";")

    def _declare(
        self,
        names: Sequence[str],
        kind: str,
        bounds: tuple[tuple[int, int], ...],
        initial: list[Value] | None,
        section: str,
        constant: bool,
    ) -> None:
        size = 1
        for low, high in bounds:
            size *= high - low + 1
        nought: Value = False if kind == "BOOL" else 0 if is_integer(kind) else 0.0
        values = initial or []
        if len(values) > size:
            raise self.wrong(f"{names[0]} has {size} elements and {len(values)} initial values")
        whole = (*values, *[nought] * (size - len(values)))
        for name in names:
            self.unit.variables[name] = Variable(name, kind, bounds, whole, section, constant)

    def _bounds(self) -> tuple[int, int]:
        low = self._constant("INT")
        self.take("..")
        high = self._constant("INT")
        if not low <= high:
            raise self.wrong(f"the array's bounds {low}..{high} hold no element")
        return int(low), int(high)

    def _initial(self, kind: str, array: bool) -> list[Value]:
        if not array:
            return [self._constant(kind)]
        self.take("[")
        values = [self._constant(kind)]
        while self.took(","):
            values.append(self._constant(kind))
        self.take("]")
        return values

    def _constant(self, kind: str) -> Value:
        """The value of an expression without variables, as a type holds it."""
        expression = self.expression()
        if expression.reads:
            raise self.wrong(f"a constant was to stand here and not the variable {min(expression.reads)[0]}")
        self._require_fit(expression, kind, "the value")
        try:
            return held(expression.value(new_frame({})), kind)
        except TypeFault as fault:
            raise self.wrong(str(fault)) from None

    def _type(self) -> str:
        if self.at.text not in TYPES:
            raise self.wrong(
                f"'{self.at.text}' is not one of the types {', '.join(TYPES)}, which are read here"
            )
        return self.take().text

    def _require_fit(self, expression: Expression, kind: str, what: str) -> None:
        if not fits(expression.kind, kind):
            raise self.wrong(f"{what} is {expression.kind}, which does not become {kind} by itself")

    def _statements(self, *ends: str) -> list[Statement]:
        body: list[Statement] = []
        while self.at.text not in ends:
            if self.took(";"):
                continue
            body.append(self._statement())
        return body

    def _statement(self) -> Statement:
        line = self.at.line
        if self.took("IF"):
            run, reads, writes = self._if()
        elif self.took("CASE"):
            run, reads, writes = self._case()
        elif self.took("FOR"):
            run, reads, writes = self._for()
        else:
            run, reads, writes = self._assignment()
        self.take(";")
        return Statement(line, run, reads, writes)

    def _assignment(self):
        if self.at.kind != "name":
            raise self.wrong(f"a statement was to stand here and not '{self.at.text}'")
        variable, index = self.variable()
        if variable.constant:
            raise self.wrong(f"{variable.name} is a constant")
        self.take(":=")
        expression = self.expression()
        self._require_fit(expression, variable.kind, f"what {variable.name} is given")

        place = self.constant_place(variable, index)
        if place is not None:
            written = frozenset({(variable.name, place)})
            return (
                lambda frame, mask: assign(frame, variable, place, expression.value(frame), mask),
                expression.reads,
                written,
            )

        def run(frame: Frame, mask) -> None:
            somewhere = variable.place([each.value(frame) for each in index])
            assign(frame, variable, somewhere, expression.value(frame), mask)

        # other elements stay as they were
        reads = expression.reads.union(variable.elements(), *(each.reads for each in index))
        return run, reads, variable.elements()

    def _condition(self) -> Expression:
        condition = self.expression()
        if condition.kind != "BOOL":
            raise self.wrong(f"a condition is BOOL and not {condition.kind}")
        return condition

    def _if(self):
        branches: list[Branch] = []
        otherwise: list[Statement] = []
        while True:
            condition = self._condition()
            self.take("THEN")
            branches.append((condition, self._statements("ELSIF", "ELSE", "END_IF")))
            if not self.took("ELSIF"):
                break
        if self.took("ELSE"):
            otherwise = self._statements("END_IF")
        self.take("END_IF")
        return self._chosen(branches, otherwise)

    def _case(self):
        selector = self.expression()
        if not is_integer(selector.kind):
            raise self.wrong(f"CASE chooses by an integer and not by {selector.kind}")
        self.take("OF")
        branches: list[Branch] = []
        otherwise: list[Statement] = []
        while self.at.text not in ("ELSE", "END_CASE"):
            matches = [self._label(selector)]
            while self.took(","):
                matches.append(self._label(selector))
            self.take(":")
            condition = matches[0]
            for other in matches[1:]:
                condition = _either(condition, other)
            branches.append((condition, self._statements_of_case()))
        if self.took("ELSE"):
            otherwise = self._statements("END_CASE")
        self.take("END_CASE")
        return self._chosen(branches, otherwise)

    def _statements_of_case(self) -> list[Statement]:
        body: list[Statement] = []
        while self.at.text not in ("ELSE", "END_CASE") and self.at.kind != "integer" and self.at.text != "-":
            if not self.took(";"):
                body.append(self._statement())
        return body

    def _label(self, selector: Expression) -> Expression:
        """Whether the selector is a label's value, or within its range."""
        low = self._constant("LINT")
        high = self._constant("LINT") if self.took("..") else low
        above, below = COMPARISONS[">="], COMPARISONS["<="]
        both = logic("AND")
        return Expression(
            "BOOL",
            lambda frame: both(above(selector.value(frame), low), below(selector.value(frame), high)),
            selector.reads,
        )

    def _chosen(self, branches: list[Branch], otherwise: list[Statement]):
        bodies = [*(body for _, body in branches), otherwise]
        conditions = NONE.union(*(condition.reads for condition, _ in branches))
        reads = conditions.union(*(each.reads for body in bodies for each in body))
        writes = NONE.union(*(each.writes for body in bodies for each in body))
        # a branch that is not taken leaves its variables as they were
        return (
            lambda frame, mask: choose(branches, otherwise, frame, mask, self.source),
            reads | writes,
            writes,
        )

    def _for(self):
        variable, index = self.variable()
        if index or not is_integer(variable.kind):
            raise self.wrong(f"FOR counts a single integer, and {variable.name} is none")
        self.take(":=")
        first = self.expression()
        self.take("TO")
        last = self.expression()
        step = Expression(variable.kind, lambda frame: 1)
        if self.took("BY"):
            step = self.expression()
        self.take("DO")
        limits = (first, last, step)
        for limit in limits:
            self._require_fit(limit, variable.kind, f"a limit of {variable.name}")
        body = self._statements("END_FOR")
        self.take("END_FOR")
        counter = variable.elements()
        if any(counter & each.writes for each in body):
            raise self.wrong(f"FOR: {variable.name} is written to inside its own loop")
        inner = NONE.union(*(each.reads for each in body), *(limit.reads for limit in limits))
        writes = counter.union(*(each.writes for each in body))
        reads = (inner | writes) - counter
        return lambda frame, mask: count(variable, limits, body, frame, mask, self.source), reads, writes


def _either(left: Expression, right: Expression) -> Expression:
    compute: Callable[[Value, Value], Value] = logic("OR")
    return Expression("BOOL", lambda frame: compute(left.value(frame), right.value(frame)), left.reads)
