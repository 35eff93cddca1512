"""Formulas of effects (`identify.effects.expression`) in Python, C and structured text."""

from __future__ import annotations

import ast
from collections.abc import Iterable, Mapping
from dataclasses import dataclass

from identify.export.exported_model import ExportedModel, Torque


def one_line(text: str) -> str:
    """Somebody's name of something, to stand in a comment: no line ends and no signs that a compiler refuses."""
    return " ".join("".join(sign if sign.isprintable() else " " for sign in text).split())


@dataclass(frozen=True)
class Dialect:
    """How a language writes a formula.

    functions : the language's name of each function of the formula language
    power     : the function of base and exponent
    signals   : the exported text's name of each signal, with the {row} that a torque acts on, the {motor} that owns it and
                the {state} of its memory
    """

    functions: Mapping[str, str]
    power: str
    signals: Mapping[str, str]


_SIGNALS = {
    **{name: f"{name}[{{row}}]" for name in ("q", "dq", "ddq", "load", "temp", "direction")},
    "torque": "whole[{row}]",
    "t": "t",
    "memory": "state[{state}]",
    "load_slope": "slope[{row}]",
    "gravity_1": "across_1[{row}]",
    "gravity_2": "across_2[{row}]",
    "motor_velocity": "motor_dq[{motor}]",
    "motor_acceleration": "motor_ddq[{motor}]",
}

PYTHON = Dialect(
    {
        name: f"np.{own}"
        for name, own in {
            "sign": "sign",
            "abs": "abs",
            "exp": "exp",
            "log": "log",
            "sqrt": "sqrt",
            "sin": "sin",
            "cos": "cos",
            "tan": "tan",
            "tanh": "tanh",
            "atan": "arctan",
            "min": "minimum",
            "max": "maximum",
        }.items()
    }
    | {"finite": "_finite"},
    "np.power",
    _SIGNALS,
)
C = Dialect(
    {
        "sign": "sign_of",
        "abs": "fabs",
        "exp": "exp",
        "log": "log",
        "sqrt": "sqrt",
        "sin": "sin",
        "cos": "cos",
        "tan": "tan",
        "tanh": "tanh",
        "atan": "atan",
        "min": "fmin",
        "max": "fmax",
        "finite": "finite_of",
    },
    "pow",
    _SIGNALS,
)
_STRUCTURED_TEXT_FUNCTIONS = {
    "abs": "ABS",
    "exp": "EXP",
    "log": "LN",
    "sqrt": "SQRT",
    "sin": "SIN",
    "cos": "COS",
    "tan": "TAN",
    "atan": "ATAN",
    "min": "MIN",
    "max": "MAX",
}
_STRUCTURED_TEXT_SIGNALS = {
    signal: array.upper() + bracket + index
    for signal, name in _SIGNALS.items()
    for array, bracket, index in [name.partition("[")]
}


def structured_text_dialect(block: str) -> Dialect:
    """Structured text of a function block; functions that the standard does not have bear the block's name in front, so
    that several models stand in one project."""
    beside = {name: f"{block}_{name.upper()}" for name in ("sign", "tanh", "finite")}
    return Dialect(_STRUCTURED_TEXT_FUNCTIONS | beside, "EXPT", _STRUCTURED_TEXT_SIGNALS)


_OPERATORS: Mapping[type[ast.operator], str] = {ast.Add: "+", ast.Sub: "-", ast.Mult: "*", ast.Div: "/"}


def render(formula: str, names: Mapping[str, str], dialect: Dialect) -> str:
    """A formula in a language.

    names : what stands for each signal there
    :raises KeyError: a signal has no name there.
    """
    return _render(ast.parse(formula, mode="eval").body, names, dialect)


def torque_text(model: ExportedModel, torque: Torque, dialect: Dialect) -> str:
    """The torque of one effect on one joint in a language."""
    state = model.memories.index(torque.memory) if torque.memory is not None else None
    names = {
        signal: name.format(row=torque.row, motor=torque.motor, state=state)
        for signal, name in dialect.signals.items()
    }
    names["motor_load"] = _sum_over_joints(model.load_shares[torque.motor], "load", dialect)
    names["motor_share"] = literal(float(model.shares[torque.row, torque.motor]))
    if torque.turns:
        names["motor_velocity"] = _sum_over_joints(torque.turns, "dq", dialect)
        names["motor_acceleration"] = _sum_over_joints(torque.turns, "ddq", dialect)
        names["motor_share"] = literal(torque.turns[torque.row])
    return render(torque.formula, names, dialect)


def _sum_over_joints(shares: Iterable[float], signal: str, dialect: Dialect) -> str:
    """What a motor has of the joints' signals of a name, a share of each, in a language."""
    parts = [
        f"{literal(float(share))} * {dialect.signals[signal].format(row=joint)}"
        for joint, share in enumerate(shares)
        if share != 0
    ]
    return f"({' + '.join(parts)})"


def _render(node: ast.expr, names: Mapping[str, str], dialect: Dialect) -> str:
    if isinstance(node, ast.Constant) and isinstance(node.value, int | float):
        return literal(float(node.value))
    if isinstance(node, ast.Name):
        return literal(3.141592653589793) if node.id == "pi" else names[node.id]
    if isinstance(node, ast.UnaryOp):
        operand = _render(node.operand, names, dialect)
        return f"(-{operand})" if isinstance(node.op, ast.USub) else operand
    if isinstance(node, ast.BinOp):
        left, right = (_render(side, names, dialect) for side in (node.left, node.right))
        if isinstance(node.op, ast.Pow):
            return f"{dialect.power}({left}, {right})"
        return f"({left} {_OPERATORS[type(node.op)]} {right})"
    assert isinstance(node, ast.Call)  # nothing else passes the parser of formulas
    assert isinstance(node.func, ast.Name)
    arguments = ", ".join(_render(argument, names, dialect) for argument in node.args)
    return f"{dialect.functions[node.func.id]}({arguments})"


def literal(value: float) -> str:
    """A number as Python, C and structured text read it, exact; in brackets where it is negative."""
    text = repr(abs(float(value)))
    mantissa, e, exponent = text.partition("e")
    if "." not in mantissa:
        mantissa += ".0"
    text = mantissa + (f"E{int(exponent)}" if e else "")
    return f"(-{text})" if value < 0 else text
