"""Hidden effects as a rig file names them: what is needed, and what holds where nothing is said."""

import math
import re
import typing

import pytest
from pydantic import TypeAdapter, ValidationError

from drivers.simulated.hidden_effect_settings import HiddenEffectSettings

EFFECTS = typing.get_args(typing.get_args(HiddenEffectSettings)[0])
READ = TypeAdapter(HiddenEffectSettings)
# Effect: what must be said. What may be left out, and what holds then: nothing, or the value of the docstring's formula at
# which it stays what its name says.
NEEDED = {
    "joint-spring": ({"stiffness": 1.0}, {"rest": 0.0}),
    "gravity-spring": (
        {"stiffness": 1.0, "base_radius": 1.0, "link_radius": 1.0, "free_length": 0.0},
        {"aligned_at": math.pi / 2},
    ),
    "torque-ripple": ({"amplitude": 1.0, "order": 1.0}, {"phase": 0.0}),
    "cogging": ({"amplitude": 1.0, "order": 1.0}, {"phase": 0.0}),
    "current-ripple": ({"amplitude": 0.5, "order": 1.0}, {"phase": 0.0}),
    "elasticity": ({"stiffness": 1.0}, {"damping": 0.0}),
    "backlash": ({"gap": 1.0}, {}),
    "friction-warmup": ({"excess": 1.0, "time_constant": 1.0}, {}),
    "friction-temperature": ({"coefficient": 1.0}, {"reference": 22.0}),
    "gain-saturation": ({"limit": 1.0}, {}),
    "delay": ({"seconds": 0.1}, {}),
    "gravity-tilt": ({}, {"about_x": 0.0, "about_y": 0.0, "about_z": 0.0}),
    "payload-mass": ({"factor": 1.0}, {}),
    "payload-com": ({"shift": [1.0, 2.0, 3.0]}, {}),
    "sticky-spot": ({"extra": 1.0, "centre": 1.0, "width": 1.0}, {}),
    "friction-position": ({"amplitude": 0.5}, {"order": 1.0, "phase": 0.0}),
    "stribeck": ({"extra": 1.0, "velocity": 1.0}, {}),
    "viscous-asymmetric": ({"difference": 1.0}, {}),
    "viscous-quadratic": ({"coefficient": 1.0}, {}),
    "viscous-cubic": ({"coefficient": 1.0}, {}),
    "viscous-power": ({"coefficient": 1.0, "exponent": 3.0}, {}),
    "presliding": ({"displacement": 1.0}, {"damping": 0.0}),
    "drive-gain": ({"factor": 1.0}, {}),
    "cable-snag": ({"beyond": 1.0, "stiffness": 1.0}, {"chafing": 0.0, "upwards": True}),
    "brake-drag": ({"torque": 1.0, "mean_interval": 1.0, "mean_duration": 1.0}, {}),
    "loose-clamp": ({"mass": 1.0, "radius": 1.0, "play": 1.0}, {"friction": 0.15, "time_constant": 0.02}),
    "amplifier-dead-band": ({"band": 1.0}, {}),
}


def test_every_effect_is_named_after_what_it_is_and_is_listed_here():
    named = {re.sub(r"(?<!^)(?=[A-Z])", "-", effect.__name__).lower() for effect in EFFECTS}
    assert named == set(NEEDED)
    assert len(EFFECTS) == len(NEEDED)


@pytest.mark.parametrize("name", NEEDED)
def test_what_is_left_out_is_what_the_formula_calls_nothing(name):
    needed, left_out = NEEDED[name]
    read = READ.validate_python({"effect": name, **needed})
    assert read.effect == name
    assert read.joint == 1
    assert {field: getattr(read, field) for field in left_out} == left_out
    assert set(type(read).model_fields) == {"effect", "joint", *needed, *left_out}
    for field in needed:
        with pytest.raises(ValidationError, match=field):
            READ.validate_python(
                {"effect": name, **{key: value for key, value in needed.items() if key != field}}
            )


@pytest.mark.parametrize("name", NEEDED)
@pytest.mark.parametrize("value", [math.nan, math.inf, -math.inf])
def test_no_quantity_is_endless(name, value):
    needed, left_out = NEEDED[name]
    for field, present in (needed | left_out).items():
        if not isinstance(present, list | bool):
            with pytest.raises(ValidationError, match=field):
                READ.validate_python({"effect": name, **needed, field: value})


@pytest.mark.parametrize(
    "wrong",
    [
        {"effect": "cogging", "amplitude": 1.0, "order": 1.0, "joint": 0},
        {"effect": "cogging", "amplitude": 1.0, "order": 1.0, "phases": 0.1},
        {"effect": "coging", "amplitude": 1.0, "order": 1.0},
        {"amplitude": 1.0, "order": 1.0},
        {"effect": "payload-com", "shift": [1.0, 2.0]},
    ],
)
def test_what_is_no_such_effect_is_refused(wrong):
    with pytest.raises(ValidationError):
        READ.validate_python(wrong)


# The lowest and highest that physics allows: at the bound where it is closed, a hair beyond it where it is open.
@pytest.mark.parametrize(
    ("name", "field", "allowed", "refused"),
    [
        ("current-ripple", "amplitude", (0.0, 0.999), (-1e-9, 1.0)),
        ("friction-position", "amplitude", (0.0, 0.999), (-1e-9, 1.0)),
        ("viscous-power", "exponent", (1e-9, 3.0), (0.0, 3.001)),
        ("delay", "seconds", (1e-9, 0.1), (0.0, 0.101)),
        ("gravity-spring", "free_length", (0.0, 5.0), (-1e-9,)),
        ("gravity-spring", "base_radius", (1e-9,), (0.0,)),
        ("backlash", "gap", (1e-9,), (0.0,)),
        ("payload-mass", "factor", (1e-9, 2.0), (0.0, -1.0)),
        ("joint-spring", "stiffness", (-30.0, 0.0), ()),
        ("loose-clamp", "friction", (0.0,), (-1e-9,)),
        ("brake-drag", "mean_interval", (1e-9,), (0.0,)),
    ],
)
def test_a_quantity_may_be_what_physics_allows(name, field, allowed, refused):
    needed = NEEDED[name][0]
    for value in allowed:
        assert getattr(READ.validate_python({"effect": name, **needed, field: value}), field) == value
    for value in refused:
        with pytest.raises(ValidationError, match=field):
            READ.validate_python({"effect": name, **needed, field: value})
