"""The effects' formulas as the exports write them."""

from __future__ import annotations

import numpy as np
import pytest

from identify.effects.catalogue import effects
from identify.effects.expression import parse
from identify.export.expression_code import literal


@pytest.mark.parametrize("name", sorted(effects()))
def test_every_effect_with_formulas_has_one_for_each_column_that_parses(name):
    effect = effects()[name]
    tried = {
        "presliding_distance": 0.01,
        "rotor_inertia": 0.2,
        "stribeck_velocity": 0.1,
        "time_constant": 10.0,
        "across_sessions": 0.0,
        "exponent": 0.5,
        "from": -1.0,
        "to": 1.0,
        "knots": 5.0,
        "threshold": 1.0,
        "power": 2.0,
        "wave_number": 20.0,
        "flank_load": 5.0,
        "rotor": 1.0,
    }
    constants = {"wave_number": 20.0} if "ripple" in name else tried
    formulas = effect.formulas(constants)
    if formulas is None:
        return
    further = dict.fromkeys(
        (
            "direction",
            "memory",
            "load_slope",
            "gravity_1",
            "gravity_2",
            "motor_velocity",
            "motor_acceleration",
            "motor_share",
        ),
        None,
    )
    values = {own: np.array([0.3]) for own in ("q", "dq", "ddq", "load", "torque", "t", "temp", *further)}
    for formula in formulas:
        assert np.isfinite(parse(formula, further)(values)).all()


@pytest.mark.parametrize("value", [0.0, 1.0, -2.5, 1e-300, 1.5e300, 3, 0.1, -1e-7])
def test_numbers_are_written_exactly_in_every_language(value):
    text = literal(value)
    assert eval(text) == value
    assert "." in text
