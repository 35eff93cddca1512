"""Small changes to a module that a test should notice: an operator, a comparison, a constant."""

from __future__ import annotations

import ast
from collections.abc import Iterator
from dataclasses import dataclass
from itertools import pairwise

OPERATORS = {
    ast.Add: ("+", "-"),
    ast.Sub: ("-", "+"),
    ast.Mult: ("*", "/"),
    ast.Div: ("/", "*"),
    ast.FloorDiv: ("//", "*"),
    ast.Mod: ("%", "*"),
    ast.Pow: ("**", "*"),
    ast.MatMult: ("@", "*"),
}
COMPARISONS = {
    ast.Lt: ("<", "<="),
    ast.LtE: ("<=", "<"),
    ast.Gt: (">", ">="),
    ast.GtE: (">=", ">"),
    ast.Eq: ("==", "!="),
    ast.NotEq: ("!=", "=="),
    ast.Is: ("is", "is not"),
    ast.IsNot: ("is not", "is"),
    ast.In: ("in", "not in"),
    ast.NotIn: ("not in", "in"),
}
CONNECTIVES = {ast.And: ("and", "or"), ast.Or: ("or", "and")}
IDLE_KEYWORDS = {
    # what only pyright, a reader or the documentation of REST looks at
    "dataclass": {"frozen", "slots", "kw_only"},
    "ConfigDict": {"frozen"},
    "Field": {"examples"},
    # how much is remembered or copied, not what
    "lru_cache": {"maxsize"},
    "astype": {"copy"},
    # what ends with the process or is laid out for a reader
    "Thread": {"daemon"},
    "Process": {"daemon"},
    "dumps": {"indent"},
    "warn": {"stacklevel"},
    # an assertion on two lengths that are equal by construction
    "zip": {"strict"},
}
"""Keyword arguments, by the function that takes them, that change nothing which a test of behaviour could see"""
IDLE_CALLS = {"problems"}
"""calls that only describe a route in the OpenAPI document"""
LOGGERS = {"_log", "logging"}


@dataclass(frozen=True, order=True)
class Mutation:
    """Bytes of a module's source that are replaced by others."""

    start: int
    stop: int
    new: str

    def apply(self, source: bytes) -> bytes:
        """The mutated source."""
        return source[: self.start] + self.new.encode() + source[self.stop :]

    def line(self, source: bytes) -> int:
        """The number of the line it is on."""
        return source.count(b"\n", 0, self.start) + 1


def mutations(source: bytes) -> list[Mutation]:
    """Every mutation of a module, in the order of its text.

    Left alone is what nothing computes with: annotations, the items of `__all__`, words for the log, what only a type checker
    or a reader of the REST documentation looks at (`IDLE_KEYWORDS`).
    """
    starts = [0]
    for line in source.split(b"\n"):
        starts.append(starts[-1] + len(line) + 1)
    tree = ast.parse(source)
    idle = _idle(tree)
    found = {
        mutation
        for node in ast.walk(tree)
        if id(node) not in idle
        for mutation in _of_node(node, source, starts)
    }
    return sorted(found)


def _idle(tree: ast.AST) -> set[int]:
    """Ids of all nodes that nothing computes with."""
    roots: list[ast.AST | None] = []
    for node in ast.walk(tree):
        if isinstance(node, ast.FunctionDef | ast.AsyncFunctionDef):
            roots.append(node.returns)
        elif isinstance(node, ast.arg | ast.AnnAssign):
            roots.append(node.annotation)
        elif isinstance(node, ast.If) and "TYPE_CHECKING" in ast.unparse(node.test):
            roots += node.body
        elif isinstance(node, ast.Call):
            roots += _idle_arguments(node)
        elif isinstance(node, ast.ClassDef):
            roots += [keyword.value for keyword in node.keywords if keyword.arg == "frozen"]
    return {id(node) for root in roots if root is not None for node in ast.walk(root)}


def _idle_arguments(call: ast.Call) -> list[ast.AST]:
    owner, _, name = ast.unparse(call.func).rpartition(".")
    if name in IDLE_CALLS or owner in LOGGERS:
        return [call]
    idle = IDLE_KEYWORDS.get(name, set())
    return [keyword.value for keyword in call.keywords if keyword.arg in idle]


def _of_node(node: ast.AST, source: bytes, starts: list[int]) -> Iterator[Mutation]:
    if isinstance(node, ast.BinOp) and type(node.op) in OPERATORS:
        yield from _between(node.left, node.right, *OPERATORS[type(node.op)], source, starts)
    elif isinstance(node, ast.AugAssign) and type(node.op) in OPERATORS:
        old, new = OPERATORS[type(node.op)]
        yield from _between(node.target, node.value, f"{old}=", f"{new}=", source, starts)
    elif isinstance(node, ast.Compare):
        sides = [node.left, *node.comparators]
        for (left, right), operator in zip(pairwise(sides), node.ops, strict=True):
            yield from _between(left, right, *COMPARISONS[type(operator)], source, starts)
    elif isinstance(node, ast.BoolOp):
        for left, right in pairwise(node.values):
            yield from _between(left, right, *CONNECTIVES[type(node.op)], source, starts)
    elif isinstance(node, ast.UnaryOp) and isinstance(node.op, ast.USub | ast.Not):
        begin = _place(node, starts)[0]
        yield Mutation(begin, _place(node.operand, starts)[0], "")
    elif isinstance(node, ast.Constant) and type(node.value) in (int, float, bool):
        yield Mutation(*_place(node, starts), _other(node.value))


def _other(value: bool | int | float) -> str:
    """Another value of a constant: the other truth, one more, twice as much."""
    if isinstance(value, bool):
        return str(not value)
    if isinstance(value, int):
        return str(value + 1)
    return repr(2.0 * value if value else 1.0)


def _between(
    left: ast.AST, right: ast.AST, old: str, new: str, source: bytes, starts: list[int]
) -> Iterator[Mutation]:
    first, last = _place(left, starts)[1], _place(right, starts)[0]
    at = source.find(old.encode(), first, last)
    if at >= 0:
        yield Mutation(at, at + len(old), new)


def _place(node: ast.AST, starts: list[int]) -> tuple[int, int]:
    """First byte of a node, and the one behind it."""
    assert isinstance(node, ast.expr)
    assert node.end_lineno is not None
    assert node.end_col_offset is not None
    return starts[node.lineno - 1] + node.col_offset, starts[node.end_lineno - 1] + node.end_col_offset
