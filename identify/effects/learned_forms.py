"""What a torque that no catalogue knows can be described with: tables of support points, and a short library of closed forms.

Each is a user's own effect (`expression.py`), so that what describes a record is stored, added, exported and taken out as
any effect is. It names no cause.
"""

import re
from collections.abc import Callable, Collection, Iterator, Sequence
from dataclasses import dataclass
from itertools import pairwise
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from identify.effects.expression import OwnEffect, OwnEffectFile
from identify.effects.motion import JointSummary

Array = NDArray[np.float64]
Sense = Literal["plain", "turned", "both"]
"""plain: a torque over the variable; turned: one that changes its sign with the direction of motion, as friction does;
both: a torque of its own for each direction"""

DIRECTIONS: dict[Sense, tuple[str, ...]] = {
    "plain": ("",),
    "turned": ("direction * ",),
    "both": ("max(0, -direction) * ", "max(0, direction) * "),
}
"""What each value of a table is multiplied with; of both senses backwards first."""
POINTS = (4, 6, 9, 13)
"""support points of the tables that are tried"""
MOST_COLUMNS = 12
"""of a user's own effect"""
PLACES = 12
"""Places over the range that the edge, bump or step of a form is tried at; what is chosen is searched finer in the fit."""
FINER = 7
"""values of each constant that the stored effect searches, between the neighbours of the choice"""


@dataclass(frozen=True)
class LearnedVariable:
    """A variable that a description may run over.

    name    : as documents name it: q, dq, load, time, temperature, or the position of another joint: q and its number
    effect  : name of an effect that is learned over it
    title   : as a part of a sentence
    formula : in the language of own effects
    unit    : SI
    low, high : its range in the record
    deviation_from_chord : whether a straight line over it is in every model, so that a table is to be zero at both ends
    """

    name: str
    effect: str
    title: str
    formula: str
    unit: str
    low: float
    high: float
    deviation_from_chord: bool = False
    picture: Literal["q", "dq", "ddq", "load", "time", "temperature"] = "q"


@dataclass(frozen=True)
class Description:
    """One way to describe a torque over a variable.

    knots : (points,) support points of a table; none of a closed form
    form  : None of a table
    """

    variable: LearnedVariable
    sense: Sense
    effect: OwnEffect
    knots: tuple[float, ...] = ()
    form: "ClosedForm | None" = None


@dataclass(frozen=True)
class ClosedForm:
    """A formula with few constants.

    columns   : with {x} for the variable
    constants : of a range (low, high): values of each constant to try
    one_sided : whether it acts on one side of an edge only
    unit      : of its parameters, with {torque} and {x} for the units of torque and variable
    over      : names of the variables that it is tried over; all if none
    """

    name: str
    columns: tuple[str, ...]
    constants: Callable[[float, float], dict[str, Array]]
    one_sided: bool = False
    unit: str = "{torque}"
    over: frozenset[str] = frozenset()


def _places(low: float, high: float) -> Array:
    """Places inside a range, its ends apart."""
    return np.linspace(low, high, PLACES + 2)[1:-1]


def _one_sided(power: float) -> Iterator[ClosedForm]:
    unit = "{torque}/{x}" if power == 1 else f"{{torque}}/({{x}})^{power:g}"
    exponent = "" if power == 1 else f"**{power:g}"
    for side, inside in (("above", "{x} - edge"), ("below", "edge - {x}")):
        yield ClosedForm(
            f"zero up to an edge, then the power {power:g} of the way {side} it",
            (f"max(0, {inside}){exponent}",),
            lambda low, high: {"edge": _places(low, high)},
            one_sided=True,
            unit=unit,
        )


LIBRARY: tuple[ClosedForm, ...] = (
    *(form for power in (1.0, 1.5, 2.0) for form in _one_sided(power)),
    ClosedForm(
        "a straight line outside of a gap",
        ("sign({x} - centre) * max(0, abs({x} - centre) - half)",),
        lambda low, high: {
            "centre": np.linspace(low, high, 10)[1:-1],
            "half": (high - low) * np.array([0.02, 0.05, 0.1, 0.16, 0.24, 0.34]),
        },
        unit="{torque}/{x}",
    ),
    ClosedForm(
        "a bump at one place",
        ("exp(-(({x} - place) / width)**2)",),
        lambda low, high: {
            "place": _places(low, high),
            "width": (high - low) * np.array([0.02, 0.04, 0.08, 0.14, 0.25]),
        },
    ),
    ClosedForm(
        "a place that holds or repels",
        ("({x} - place) / width * exp(-(({x} - place) / width)**2)",),
        lambda low, high: {
            "place": _places(low, high),
            "width": (high - low) * np.array([0.02, 0.04, 0.08, 0.14, 0.25]),
        },
    ),
    ClosedForm(
        "a step at one place",
        ("tanh(({x} - place) / width)",),
        lambda low, high: {
            "place": _places(low, high),
            "width": (high - low) * np.array([0.01, 0.03, 0.08, 0.2]),
        },
    ),
    ClosedForm(
        "one wave",
        ("cos(wave * {x})", "sin(wave * {x})"),
        lambda low, high: {"wave": 2 * np.pi / (high - low) * np.linspace(0.5, 8.0, 31)},
    ),
    ClosedForm(
        "a decay",
        ("exp(-{x} / scale)",),
        lambda low, high: {"scale": high * np.geomspace(0.03, 1.0, 9)},
        over=frozenset({"dq", "time"}),
    ),
    ClosedForm(
        "a straight line",
        ("{x}",),
        lambda low, high: {},
        unit="{torque}/{x}",
        over=frozenset({"time", "temperature", "neighbour"}),
    ),
)
"""The closed forms that are proposed."""


def variables_of(
    summary: JointSummary, all_joints: Sequence[JointSummary], taken: Collection[str] = ()
) -> list[LearnedVariable]:
    """What a joint's torque may depend on, as far as the record has it and it changes.

    taken : names that other effects have
    """

    def named(title: str) -> tuple[str, str]:
        plain = f"learned-{_slug(title)}-{_slug(summary.name)}"
        names = (plain, *(f"{plain}-{number}" for number in range(2, len(taken) + 2)))
        return next(each for each in names if each not in taken), title

    way, speed = ("rad", "rad/s") if summary.revolute else ("m", "m/s")
    torque = "N m" if summary.revolute else "N"
    low, high = summary.load_range
    listed = [
        LearnedVariable("q", *named("the position"), "q", way, *summary.position_range),
        LearnedVariable("dq", *named("the speed"), "abs(dq)", speed, 0.0, summary.maximum_speed, True, "dq"),
        LearnedVariable("load", *named("the load"), "load", torque, low, high, True, "load"),
        LearnedVariable(
            "time",
            *named("the time"),
            "t",
            "s",
            0.0,
            max(summary.session_durations, default=0.0),
            picture="time",
        ),
    ]
    if summary.has_temperature and summary.temperature_range is not None:
        listed.append(
            LearnedVariable(
                "temperature",
                *named("the temperature"),
                "temp",
                "°C",
                *summary.temperature_range,
                picture="temperature",
            )
        )
    listed += [
        LearnedVariable(
            f"q{other.joint + 1}",
            *named(f"the position of {other.name}"),
            f"q{other.joint + 1}",
            "rad" if other.revolute else "m",
            *other.position_range,
        )
        for other in all_joints
        if other.joint != summary.joint
    ]
    return [each for each in listed if each.high - each.low > 1e-9]


def tables(variable: LearnedVariable, summary: JointSummary) -> Iterator[Description]:
    """Tables of evenly spaced support points, linear between them and constant beyond.

    The value at the first point is zero: what is the same everywhere is the offset's, or the dry friction's. Where a
    straight line is in every model the value at the last point is zero too.
    """
    low, high = (float(f"{end:.6g}") for end in (variable.low, variable.high))
    senses: tuple[Sense, ...] = ("plain", "turned", "both")
    for sense in senses:
        for points in POINTS:
            width = float(f"{(high - low) / (points - 1):.6g}")
            knots = tuple(float(f"{low + width * place:.6g}") for place in range(points))
            free = knots[1:-1] if variable.deviation_from_chord else knots[1:]
            if width <= 0 or len(free) * (2 if sense == "both" else 1) > MOST_COLUMNS:
                continue
            place = f"min(max({variable.formula}, {low!r}), {knots[-1]!r})"
            hats = [f"max(0, 1 - abs({place} - {knot!r}) / {width!r})" for knot in free]
            columns = [factor + hat for factor in DIRECTIONS[sense] for hat in hats]
            yield Description(variable, sense, _effect(variable, sense, summary, columns, {}, ""), knots)


def closed_forms(variable: LearnedVariable, sense: Sense, summary: JointSummary) -> Iterator[Description]:
    """The library over a variable; nothing where each direction has a torque of its own."""
    if sense == "both":
        return
    kind = variable.name if variable.name in {"q", "dq", "load", "time", "temperature"} else "neighbour"
    for form in LIBRARY:
        if form.over and kind not in form.over:
            continue
        texts = [text.format(x=variable.formula) for text in form.columns]
        columns = [f"direction * {text}" for text in texts] if sense == "turned" else texts
        torque = "N m" if summary.revolute else "N"
        unit = form.unit.format(torque=torque, x=variable.unit)
        tried = form.constants(variable.low, variable.high)
        yield Description(
            variable, sense, _effect(variable, sense, summary, columns, tried, unit, form.name), form=form
        )


def searched_finer(coarse: Description, chosen: dict[str, float]) -> Description:
    """The description with constants that are searched between the neighbours of the chosen ones."""
    form, settings = coarse.form, coarse.effect.settings
    if form is None or not chosen:
        return coarse
    ranges = {}
    for name, values in form.constants(coarse.variable.low, coarse.variable.high).items():
        place = int(np.argmin(np.abs(values - chosen[name])))
        low, high = values[max(place - 1, 0)], values[min(place + 1, len(values) - 1)]
        ranges[name] = _range(low, high, FINER)
    changed = settings.model_dump(by_alias=True) | {"constants": ranges}
    return Description(
        coarse.variable, coarse.sense, OwnEffect(OwnEffectFile.model_validate(changed)), form=form
    )


def at_points(table: Description, values: Array) -> Array:
    """(points,) or, where the direction matters, (points, 2) backwards and forwards: a table's values, (columns,), with the
    ends that are zero."""
    parts = np.split(values, len(DIRECTIONS[table.sense]))
    whole = np.zeros((len(table.knots), len(parts)))
    for column, part in enumerate(parts):
        whole[1 : 1 + len(part), column] = part
    if table.sense == "turned":
        return np.hstack([-whole, whole])
    return whole if table.sense == "both" else whole[:, 0]


def _range(low: float, high: float, count: int) -> dict[str, float | int]:
    return {"from": float(f"{low:.6g}"), "to": float(f"{high:.6g}"), "count": count}


def _effect(
    variable: LearnedVariable,
    sense: Sense,
    summary: JointSummary,
    columns: Sequence[str],
    constants: dict[str, Array],
    unit: str,
    form: str = "",
) -> OwnEffect:
    """The own effect of a description."""
    how = {
        "plain": "a torque",
        "turned": "friction, which turns with the direction of motion,",
        "both": "a torque of its own for each direction of motion",
    }[sense]
    shape = f" ({form})" if form else ""
    return OwnEffect(
        OwnEffectFile.model_validate(
            {
                "name": variable.effect,
                "columns": list(columns),
                "constants": {name: _evenly(values) for name, values in constants.items()},
                "explanation": f"Learned from the record: {how} over {variable.title}{shape} that no effect of the catalogue"
                " explains. It describes, and names no cause. Check what happens on the machine where it acts.",
                "source": "learned from the record",
                "unit": unit or ("N m" if summary.revolute else "N"),
                "variable": variable.picture,
            }
        )
    )


def _evenly(values: Array) -> dict[str, float | int | str]:
    """Values of a constant as a range of the file; in equal ratios where they are not evenly spaced."""
    steps = np.diff(values)
    even = all(abs(b - a) < 1e-6 * abs(values[-1] - values[0]) for a, b in pairwise(steps.tolist()))
    return _range(float(values[0]), float(values[-1]), len(values)) | {"scale": "linear" if even else "log"}


def _slug(title: str) -> str:
    """A name's letters and digits in small letters, joined by hyphens."""
    return re.sub(r"[^a-z0-9]+", "-", title.lower().removeprefix("the ")).strip("-") or "joint"
