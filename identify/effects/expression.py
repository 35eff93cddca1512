"""A user's own effect: expressions in a YAML file, parsed against a whitelist and never evaluated as code.

name: bearing-notch
columns: ["sign(dq) * exp(-((q - place) / width)**2)"]
constants:
  place: {from: -1.0, to: 1.0, count: 9}
  width: {from: 0.05, to: 0.5, count: 4, scale: log}
explanation: A notch in the bearing. Check the raceway.
"""

import ast
import itertools
import re
from collections.abc import Callable, Mapping
from functools import lru_cache
from pathlib import Path
from typing import Annotated, Literal

import numpy as np
from numpy.typing import NDArray
from pydantic import AfterValidator, BaseModel, ConfigDict, Field

from identify.effects.conditions import TEMPERATURE
from identify.effects.effect import Constants, Effect, number
from identify.effects.motion import Array, JointMotion, JointSummary
from identify.effects.parameter import EffectParameter
from identify.effects.picture import picture_over
from identify.recording.errors import InputError
from identify.recording.experiment_file import check_settings
from identify.recording.strict_yaml import read_strict_yaml

SIGNALS: Mapping[str, str] = {
    "q": "position, rad or m",
    "dq": "velocity, rad/s or m/s",
    "ddq": "acceleration, rad/s² or m/s²",
    "load": "tau_out of the fitted model, N m or N",
    "torque": "whole torque of the fitted model, N m or N",
    "t": "time since the session began, s",
    "temp": "temperature, °C",
    "direction": "sign of the velocity, turning where the positions as recorded turn",
}
NEIGHBOUR = re.compile(r"q[1-9][0-9]?")
"""Position of the joint of that number, rad or m: `q2` is the second joint's."""


def finite(values: Array) -> Array:
    """The values, and 0 where they are no finite number."""
    return np.nan_to_num(values, nan=0.0, posinf=0.0, neginf=0.0)


FUNCTIONS: Mapping[str, Callable[..., Array]] = {
    "sign": np.sign,
    "abs": np.abs,
    "exp": np.exp,
    "log": np.log,
    "sqrt": np.sqrt,
    "sin": np.sin,
    "cos": np.cos,
    "tan": np.tan,
    "tanh": np.tanh,
    "atan": np.arctan,
    "min": np.minimum,
    "max": np.maximum,
    "finite": finite,
}
OPERATORS: Mapping[type[ast.operator], Callable[[Array, Array], Array]] = {
    ast.Add: np.add,
    ast.Sub: np.subtract,
    ast.Mult: np.multiply,
    ast.Div: np.divide,
    ast.Pow: np.power,
}
LONGEST = 500
"""Characters of an expression; what is longer is no formula."""
MOST_VARIANTS = 64
"""Choices of constants that are tried together."""


class _Settings(BaseModel):
    model_config = ConfigDict(frozen=True, extra="forbid", defer_build=True)


class ConstantRange(_Settings):
    """Values of a nonlinear constant to try."""

    low: Annotated[float, Field(alias="from")]
    high: Annotated[float, Field(alias="to")]
    count: Annotated[int, Field(ge=1, le=MOST_VARIANTS)] = 7
    scale: Literal["linear", "log"] = "linear"

    def values(self) -> NDArray[np.float64]:
        """The values, low to high."""
        if self.scale == "log":
            return np.geomspace(self.low, self.high, self.count)
        return np.linspace(self.low, self.high, self.count)


def _effect_name(name: str) -> str:
    if not re.fullmatch(r"[a-z][a-z0-9-]*", name):
        raise ValueError(
            "use small letters without accents, digits and '-', a letter first, such as gear-drag"
        )
    return name


class OwnEffectFile(_Settings):
    """The file of a user's own effect."""

    name: Annotated[str, AfterValidator(_effect_name)]
    columns: Annotated[list[str], Field(min_length=1, max_length=12)]
    constants: dict[str, ConstantRange] = {}
    explanation: str = "A user's own effect."
    source: str = "the user's own"
    unit: str = "N m"
    variable: Literal["q", "dq", "ddq", "load", "time", "temperature"] = "dq"


Node = Callable[[Mapping[str, Array]], Array]


class OwnEffect(Effect):
    """An effect made of expressions."""

    catalogued = False
    group = "own"

    def __init__(self, settings: OwnEffectFile) -> None:
        """Raises ValueError: an expression is not a formula of the allowed signals, functions and constants."""
        self.settings = settings
        self.name = settings.name
        self.explanation = settings.explanation
        self.source = settings.source
        self.variable = settings.variable
        self.picture = picture_over(settings.variable)
        self.equation = " + ".join(f"c{index + 1} {text}" for index, text in enumerate(settings.columns))
        self.regressors = tuple(settings.columns)
        single = len(settings.columns) == 1
        self.parameters = tuple(
            EffectParameter(settings.name if single else f"{settings.name}_{index + 1}_", settings.unit)
            for index in range(len(settings.columns))
        )
        for text in settings.columns:  # refused here; the parsed form cannot travel to another process
            parse(text, settings.constants)
        self.uses_load = any(_names(text) & {"load", "torque"} for text in settings.columns)
        self.uses_torque = any("torque" in _names(text) for text in settings.columns)
        self.nonlinear = any("ddq" in _names(text) for text in settings.columns)
        self.neighbours = {
            int(name[1:]) - 1
            for text in settings.columns
            for name in _names(text) - set(settings.constants)
            if NEIGHBOUR.fullmatch(name)
        }
        warm = any("temp" in _names(text) for text in settings.columns)
        self.conditions = (TEMPERATURE,) if warm else ()
        timed = any("t" in _names(text) for text in settings.columns)
        self.inputs = (*(("temperature",) if warm else ()), *(("time",) if timed else ()))

    def grid(self, summary: JointSummary) -> list[dict[str, float]]:
        ranges = self.settings.constants
        listed = [[(name, float(value)) for value in each.values()] for name, each in ranges.items()]
        return [dict(choice) for choice in itertools.product(*listed)][:MOST_VARIANTS]

    def formulas(self, constants: Constants) -> tuple[str, ...] | None:
        if self.neighbours:
            return None  # exported code knows a joint's own signals
        texts = [with_constants(text, constants) for text in self.settings.columns]
        # as the columns below: a program that is given this formula must not make a torque of what is no number
        return tuple(f"finite({text})" if _may_have_no_value(text) else text for text in texts)

    def columns(self, motion: JointMotion, constants: Constants) -> Array:
        values: dict[str, Array] = {
            "q": motion.q,
            "dq": motion.dq,
            "ddq": motion.ddq,
            "load": motion.load,
            "torque": motion.model_torque,
            "t": motion.session_time,
            "direction": motion.direction,
            **{name: np.asarray(value) for name, value in constants.items()},
        }
        for joint in self.neighbours:
            values[f"q{joint + 1}"] = motion.positions[:, joint]
        if motion.temperature is not None:
            values["temp"] = motion.temperature
        with np.errstate(all="ignore"):
            columns = [
                np.broadcast_to(parse(text, self.settings.constants)(values), motion.q.shape)
                for text in self.settings.columns
            ]
        return finite(np.column_stack(columns))


def load_own_effect(path: Path) -> OwnEffect:
    """Read a user's own effect.

    Raises InputError: the file is no effect; names file, field and what would be right.
    """
    content, lines = read_strict_yaml(path)
    settings = check_settings(OwnEffectFile, content, lines, path)
    try:
        return OwnEffect(settings)
    except ValueError as error:
        raise InputError(f"{path}: columns: {error}") from None


def with_constants(text: str, constants: Constants) -> str:
    """A formula with its constants put in as numbers."""
    return ast.unparse(_PutIn(constants).visit(ast.parse(text, mode="eval")))


def _may_have_no_value(text: str) -> bool:
    """Whether a formula with numbers for constants can be other than a finite number: a root, a quotient, an overflow."""
    for node in ast.walk(ast.parse(text, mode="eval")):
        if isinstance(node, ast.Call) and isinstance(node.func, ast.Name):
            if node.func.id in ("log", "sqrt", "exp", "tan"):
                return True
        elif isinstance(node, ast.BinOp) and isinstance(node.op, ast.Div):
            if not (isinstance(node.right, ast.Constant) and node.right.value):
                return True
        elif isinstance(node, ast.BinOp) and isinstance(node.op, ast.Pow):
            exponent = node.right.value if isinstance(node.right, ast.Constant) else -1
            if not (isinstance(exponent, int | float) and exponent >= 0 and float(exponent).is_integer()):
                return True
    return False


class _PutIn(ast.NodeTransformer):
    def __init__(self, constants: Constants) -> None:
        self.constants = constants

    def visit_Name(self, node: ast.Name) -> ast.expr:
        if node.id in self.constants:
            return ast.parse(number(self.constants[node.id]), mode="eval").body
        return node


def parse(text: str, constants: Mapping[str, object]) -> Node:
    """A formula as a function of its signals and constants.

    Raises ValueError: it holds anything but numbers, + - * / **, the signals, the functions and its constants.
    """
    return _parsed(text, frozenset(constants))


@lru_cache(maxsize=4096)
def _parsed(text: str, constants: frozenset[str]) -> Node:
    """`parse`; the formulas of an effect are asked for with every block of motion."""
    if len(text) > LONGEST:
        raise ValueError(f"'{text[:40]}…' is longer than {LONGEST} characters")
    try:
        tree = ast.parse(text, mode="eval")
    except (SyntaxError, ValueError, RecursionError):
        raise ValueError(f"'{text}' is not a formula") from None
    return _node(tree.body, text, constants | frozenset(SIGNALS))


def _node(tree: ast.expr, text: str, names: frozenset[str]) -> Node:
    if (
        isinstance(tree, ast.Constant)
        and isinstance(tree.value, int | float)
        and not isinstance(tree.value, bool)
    ):
        number = np.asarray(float(tree.value))
        return lambda values: number
    if isinstance(tree, ast.Name):
        if tree.id == "pi":
            return lambda values: np.asarray(np.pi)
        if tree.id not in names and not NEIGHBOUR.fullmatch(tree.id):
            known = ", ".join(sorted(names))
            raise ValueError(f"'{text}': '{tree.id}' is neither a signal nor a constant; there are {known}")
        name = tree.id
        return lambda values: values[name]
    if isinstance(tree, ast.UnaryOp) and isinstance(tree.op, ast.USub | ast.UAdd):
        operand = _node(tree.operand, text, names)
        return (lambda values: -operand(values)) if isinstance(tree.op, ast.USub) else operand
    if isinstance(tree, ast.BinOp) and type(tree.op) in OPERATORS:
        operator = OPERATORS[type(tree.op)]
        left, right = _node(tree.left, text, names), _node(tree.right, text, names)
        return lambda values: operator(left(values), right(values))
    if isinstance(tree, ast.Call) and isinstance(tree.func, ast.Name) and not tree.keywords:
        return _call(tree, tree.func.id, text, names)
    raise ValueError(f"'{text}': '{ast.unparse(tree)}' is not allowed in a formula")


def _call(tree: ast.Call, name: str, text: str, names: frozenset[str]) -> Node:
    if name not in FUNCTIONS:
        raise ValueError(f"'{text}': there is no function '{name}'; there are {', '.join(FUNCTIONS)}")
    wanted = 2 if name in ("min", "max") else 1
    if len(tree.args) != wanted:
        raise ValueError(f"'{text}': {name} takes {wanted} value{'s' if wanted > 1 else ''}")
    function = FUNCTIONS[name]
    arguments = [_node(argument, text, names) for argument in tree.args]
    return lambda values: function(*(argument(values) for argument in arguments))


@lru_cache(maxsize=4096)
def _names(text: str) -> frozenset[str]:
    return frozenset(node.id for node in ast.walk(ast.parse(text, mode="eval")) if isinstance(node, ast.Name))
