"""Nonlinear constants of effects in the units in which people think of them.

A ripple is so many waves a turn, of the joint and of the motor (where a gear's teeth, a motor's poles and an encoder's lines
are counted); a give of the transmission is mrad, or mm; a speed is rad/s and rpm.
"""

from collections.abc import Mapping
from math import pi

from api.pages.error_figures import JointUnits
from api.pages.number_format import THIN, number, significant

WAVES = {"wave_number": "waves per turn", "second_wave_number": "further waves per turn"}
"""Constants k of a torque that goes with cos(k q), k in 1/rad or 1/m -> words"""
CONSTANT_WORDS = {
    "stribeck_velocity": ("Stribeck velocity", "speed"),
    "rotor_inertia": ("inertia not counted as load", "inertia"),
    "exponent": ("exponent", ""),
    "power": ("exponent", ""),
    "presliding_distance": ("presliding distance", "travel"),
    "play": ("play", "travel"),
    "threshold": ("from a load of", "load"),
    "flank_load": ("load on the flank", "load"),
    "time_constant": ("time constant", "time"),
}
"""Other constants -> words, and the dimension that the unit follows from; `travel` is a small way of the joint."""
WHOLE = 0.02
"""Waves a turn this close to a whole number are shown with it in words: what turns with a shaft has a whole number."""


def constant_words(
    constants: Mapping[str, float], units: JointUnits, motor_ratio: float = 1.0
) -> list[tuple[str, str]]:
    """(words, value with unit) of the constants that the search chose; those of the grid itself are left out.

    motor_ratio : rad of the motor for one rad, or one metre, of the joint
    """
    rows = []
    for name, value in constants.items():
        if not value:
            continue
        if name in WAVES:
            rows.append((WAVES[name], _waves(value, units, motor_ratio)))
        elif name in CONSTANT_WORDS:
            text, dimension = CONSTANT_WORDS[name]
            rows.append((text, _quantity(value, dimension, units)))
    return rows


def _waves(wave_number: float, units: JointUnits, motor_ratio: float) -> str:
    if units.position == "m":
        text = f"one every {significant(2 * pi / wave_number * 1e3)}{THIN}mm"
    else:
        text = f"{_count(wave_number)} of the joint"
    return text if motor_ratio == 1.0 else f"{text}, {_count(wave_number / motor_ratio)} of the motor"


def _count(waves: float) -> str:
    """So many waves: a whole number where they are one within what can be told."""
    whole = round(waves)
    return number(whole, 0) if whole and abs(waves - whole) < WHOLE else significant(waves, 3)


def _quantity(value: float, dimension: str, units: JointUnits) -> str:
    if dimension == "travel":
        return f"{significant(value * 1e3)}{THIN}{'mm' if units.position == 'm' else 'mrad'}"
    if dimension == "speed" and units.position == "m":
        return f"{significant(value * 1e3)}{THIN}mm/s"
    if dimension == "speed":
        return f"{significant(value)}{THIN}rad/s ({significant(value * 30 / pi, 2)}{THIN}rpm)"
    unit = f"{THIN}{units.of_dimension(dimension)}" if dimension else ""
    return f"{significant(value)}{unit}"
