"""Expressions of structured text: variables, calls and operators with the standard's precedence (IEC 61131-3, 7.3.2).

From the tightest: call and brackets; + - NOT before a value; **; * / MOD; + -; < > <= >=; = <>; AND &; XOR; OR. Operators of one
rank are taken from the left.
"""

from __future__ import annotations

from collections.abc import Callable, Collection, Sequence

from identify.export.iec61131.program import NONE, Expression, Frame, RunFault, Unit, Variable, read
from identify.export.iec61131.tokens import KEYWORDS, Token, tokens
from identify.export.iec61131.values import (
    COMPARISONS,
    LITERAL,
    REALS,
    STANDARD,
    TYPES,
    TypeFault,
    Value,
    arithmetic,
    common,
    fits,
    is_integer,
    is_number,
    logic,
    opposite,
    result_kind,
)
from identify.recording.errors import InputError

Rank = tuple[tuple[str, ...], str]
RANKS: Sequence[Rank] = (
    (("OR",), "logic"),
    (("XOR",), "logic"),
    (("AND", "&"), "logic"),
    (("=", "<>"), "comparison"),
    (("<", ">", "<=", ">="), "comparison"),
    (("+", "-"), "arithmetic"),
    (("*", "/", "MOD"), "arithmetic"),
    (("**",), "arithmetic"),
)
"""operators from the loosest to the tightest"""


class ExpressionParser:
    """Goes through the words of a text.

    source : name of the file, for messages
    known  : the units that were read
    unit   : the one that is being read
    """

    def __init__(self, text: str, source: str) -> None:
        """Raises InputError: the text has what is no word of the language."""
        self.source = source
        self.known: dict[str, Unit] = {}
        self.unit = Unit("", None)
        self._words = tokens(text, source)
        self._place = 0

    @property
    def at(self) -> Token:
        """The word that comes next."""
        return self._words[self._place]

    def take(self, wanted: str | None = None) -> Token:
        """The next word, which is then behind.

        Raises InputError: it is not the one that is wanted, or the text is at its end.
        """
        word = self.at
        if (wanted is not None and word.text != wanted) or word.kind == "end":
            raise self.wrong(f"'{wanted or 'more'}' was to stand here and not '{word.text}'")
        self._place += 1
        return word

    def took(self, wanted: str) -> bool:
        """Take the next word if it is the one that is wanted."""
        if self.at.text != wanted:
            return False
        self._place += 1
        return True

    def wrong(self, fault: str) -> InputError:
        """An error at the word that comes next."""
        return InputError(f"{self.source} line {self.at.line}: {fault}")

    def new_name(self, there: Collection[str]) -> str:
        """A name for something new.

        Raises InputError: it is a word of the language, or something has it.
        """
        word = self.at
        if word.kind != "name" or word.text in KEYWORDS or word.text in STANDARD:
            raise self.wrong(f"a name was to stand here and not '{word.text}'")
        if word.text in there:
            raise self.wrong(f"there are two of the name {word.text}")
        return self.take().text

    def expression(self) -> Expression:
        """The expression that comes next.

        Raises InputError: it is none, or its types do not go together.
        """
        return self._binary(0)

    def _binary(self, rank: int) -> Expression:
        if rank == len(RANKS):
            return self._unary()
        left = self._binary(rank + 1)
        signs, sort = RANKS[rank]
        while self.at.text in signs:
            sign = self.take().text
            left = self._joined(sign, sort, left, self._binary(rank + 1))
        return left

    def _joined(self, sign: str, sort: str, left: Expression, right: Expression) -> Expression:
        one, other = left.value, right.value
        compute: Callable[[Value, Value], Value]
        if sort == "logic" or (
            sort == "comparison" and left.kind == right.kind == "BOOL" and sign in ("=", "<>")
        ):
            if not left.kind == right.kind == "BOOL":
                raise self.wrong(f"{sign} wants BOOL on both sides and has {left.kind} and {right.kind}")
            kind, compute = (
                "BOOL",
                COMPARISONS[sign] if sort == "comparison" else logic("AND" if sign == "&" else sign),
            )
        else:
            try:
                kind = common(left.kind, right.kind)
            except TypeFault as fault:
                raise self.wrong(f"{sign}: {fault}") from None
            if sign == "**" and left.kind not in REALS:
                raise self.wrong(f"** wants REAL or LREAL on its left and has {left.kind}")
            if sign == "MOD" and not is_integer(kind):
                raise self.wrong(f"MOD wants integers and has {left.kind} and {right.kind}")
            compute = arithmetic(sign, kind) if sort == "arithmetic" else COMPARISONS[sign]
            kind = kind if sort == "arithmetic" else "BOOL"
        return Expression(kind, lambda frame: compute(one(frame), other(frame)), left.reads | right.reads)

    def _unary(self) -> Expression:
        if self.took("NOT"):
            inner = self._unary()
            if inner.kind != "BOOL":
                raise self.wrong(f"NOT wants BOOL and has {inner.kind}")
            return Expression("BOOL", lambda frame: opposite(inner.value(frame)), inner.reads)
        if self.at.text in ("-", "+"):
            negative = self.take().text == "-"
            if self.at.text in ("-", "+"):
                raise self.wrong("two signs stand one behind the other")
            inner = self._unary()
            if not is_number(inner.kind):
                raise self.wrong(f"a sign stands before {inner.kind}, which is no number")
            return (
                Expression(inner.kind, lambda frame: -inner.value(frame), inner.reads) if negative else inner
            )
        return self._primary()

    def _primary(self) -> Expression:
        word = self.at
        if self.took("("):
            inner = self.expression()
            self.take(")")
            return inner
        if word.kind == "integer" or word.kind == "real":
            return self._number(self.take())
        if word.text in ("TRUE", "FALSE"):
            truth = self.take().text == "TRUE"
            return Expression("BOOL", lambda frame: truth)
        if word.kind != "name":
            raise self.wrong(f"a value was to stand here and not '{word.text}'")
        if word.text in TYPES:
            return self._typed_number()
        if word.text in STANDARD or word.text in self.known:
            return self._call()
        return self._read(*self.variable())

    def _read(self, variable: Variable, index: tuple[Expression, ...]) -> Expression:
        name = variable.name
        place = self.constant_place(variable, index)
        if place is not None:
            return Expression(
                variable.kind, lambda frame: read(frame, name, place), frozenset({(name, place)})
            )

        def value(frame: Frame) -> Value:
            return read(frame, name, variable.place([each.value(frame) for each in index]))

        return Expression(variable.kind, value, variable.elements().union(*(each.reads for each in index)))

    def constant_place(self, variable: Variable, index: tuple[Expression, ...]) -> int | None:
        """Where the element of an index is held, if that is known before the text runs.

        Raises InputError: there is no such element.
        """
        if any(each.reads for each in index):
            return None
        try:
            return variable.place([each.value({}) for each in index])
        except RunFault as fault:
            raise self.wrong(str(fault)) from None

    def _number(self, word: Token) -> Expression:
        text = word.text.replace("_", "")
        number: Value
        if word.kind == "real":
            number = float(text)
            return Expression("LREAL", lambda frame: number)
        base, _, digits = text.rpartition("#")
        try:
            number = int(digits, int(base or 10))
        except ValueError:
            raise self.wrong(f"'{word.text}' is no number") from None
        return Expression(LITERAL, lambda frame: number)

    def _typed_number(self) -> Expression:
        """LREAL#1.0, INT#5."""
        kind = self.take().text
        self.take("#")
        negative = self.took("-")
        number = self._number(self.take())
        if not (fits(number.kind, kind) or (kind == "REAL" and number.kind == "LREAL")):
            raise self.wrong(f"{kind}# stands before a number of another type")
        return Expression(kind, lambda frame: -number.value(frame) if negative else number.value(frame))

    def variable(self) -> tuple[Variable, tuple[Expression, ...]]:
        """A variable and the expressions of its index.

        Raises InputError: there is none of the name, or its index is not right.
        """
        word = self.at
        variable = self.unit.variables.get(word.text)
        if word.text in KEYWORDS:
            raise self.wrong(
                f"'{word.text}' stands where it cannot, or is a part of the language that is not read here"
            )
        if variable is None:
            raise self.wrong(
                f"there is no variable or function '{word.text}' (functions stand above what calls them)"
            )
        self.take()
        index: list[Expression] = []
        if self.took("["):
            index.append(self.expression())
            while self.took(","):
                index.append(self.expression())
            self.take("]")
        if len(index) != len(variable.bounds):
            raise self.wrong(
                f"{variable.name} has {len(variable.bounds)} indices, and {len(index)} stand here"
            )
        if not all(is_integer(each.kind) for each in index):
            raise self.wrong(f"an index of {variable.name} is no integer")
        return variable, tuple(index)

    def _call(self) -> Expression:
        name = self.take().text
        self.take("(")
        arguments = [self.expression()]
        while self.took(","):
            arguments.append(self.expression())
        self.take(")")
        kinds = [each.kind for each in arguments]
        values = [each.value for each in arguments]
        reads = NONE.union(*(each.reads for each in arguments))
        if name in STANDARD:
            try:
                kind = result_kind(STANDARD[name], kinds)
            except TypeFault as fault:
                raise self.wrong(f"{name} {fault}") from None
            compute = STANDARD[name].compute
            return Expression(kind, lambda frame: compute(*(value(frame) for value in values)), reads)
        unit = self.known[name]
        wanted = [variable.kind for variable in unit.of_section("VAR_INPUT")]
        if unit.kind is None:
            raise self.wrong(f"{name} is a function block; blocks inside blocks are not read here")
        if len(kinds) != len(wanted) or not all(map(fits, kinds, wanted)):
            raise self.wrong(f"{name} wants ({', '.join(wanted)}) and got ({', '.join(kinds)})")
        return Expression(
            unit.kind, lambda frame: unit.call([value(frame) for value in values], self.source), reads
        )
