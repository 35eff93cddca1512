"""The catalogue of effects as the pages quote it: names as a person says them, equation, explanation, source."""

import re
from functools import cache
from typing import Any

from identify.effects import catalogue as effects


@cache
def catalogue() -> dict[str, dict[str, Any]]:
    """Entry of `coulomb effects` by the effect's name."""
    return {str(entry["effect"]): entry for entry in effects.catalogue()}


def entry_of(effect: str) -> dict[str, Any]:
    """The entry of an effect; empty for a user's own that the catalogue does not list."""
    return catalogue().get(effect, {})


@cache
def effect_titles() -> dict[str, str]:
    """Name -> words for a sentence."""
    return {name: entry.get("title") or _TITLES.get(name, name) for name, entry in catalogue().items()}


@cache
def _effects_by_parameter() -> dict[str, str]:
    """Name of a parameter, without the joint's number -> the effect that it belongs to."""
    return {each.name: effect for effect, one in effects.effects().items() for each in one.parameters}


def effect_of_parameter(name: str) -> str:
    """The effect that a parameter belongs to; empty for one that the catalogue does not know."""
    stem = re.match(r"[^\[]*?(?=\d*(?:\[|$))", name)
    return _effects_by_parameter().get(stem[0] if stem else name, "")


_TITLES = {
    "viscous": "viscous friction",
    "coulomb": "dry friction",
    "offset": "an offset of the torque",
    "viscous-asymmetric": "viscous friction that differs between the directions",
    "viscous-quadratic": "friction that grows with the square of the speed",
    "viscous-cubic": "friction that grows with the cube of the speed",
    "viscous-power": "friction that rises less than linearly with speed",
    "stribeck": "friction that falls as the joint begins to slide (Stribeck)",
    "load-friction": "friction that grows with the load",
    "load-friction-asymmetric": "friction that grows with the load, more when driving than when driven",
    "load-stribeck": "friction that depends on load and speed together",
    "friction-position": "friction that varies with the position",
    "friction-temperature": "friction that varies with the temperature",
    "friction-warmup": "friction that falls while the joint warms up",
    "presliding": "elastic give before the joint slides (presliding)",
    "backlash": "play between motor and joint (backlash)",
    "torque-ripple": "torque ripple that repeats with the motor's turn",
    "current-ripple": "torque ripple that grows with the current",
    "joint-spring": "a spring at the joint",
    "gain-saturation": "a drive gain that falls at large current",
    "drive-gain": "a wrong drive gain",
    "delay": "a delay between position and current",
    "elasticity": "elasticity of the transmission",
    "motor-inertia": "inertia of the motor",
    "coupled-friction": "friction that sits on a coupled motor",
    "payload-mass": "a payload mass that differs from the one stated",
    "payload-com": "a payload centre that differs from the one stated",
    "gravity-tilt": "a base that is not level",
}
