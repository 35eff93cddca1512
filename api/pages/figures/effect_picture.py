"""The residual over the variable that an effect acts through: what a model without it leaves, and what is left with it.

A friction effect changes sign with the velocity; its error is turned by sign(q̇) first, so that loss shows above zero and
both directions fall on one curve.
"""

from dataclasses import dataclass

import numpy as np
from markupsafe import Markup

from api.pages.figures.drawing import Scale, area, curve, element, line, picture, round_ticks, text, tick_text
from api.pages.figures.error_band import ErrorBand


@dataclass(frozen=True)
class OwnVariable:
    """What an effect acts through: the name of the samples' array, its words, and whether the error is turned by sign(q̇)."""

    array: str
    words: str
    dimension: str  # "position", "speed", "acceleration", "load", "time" or "temperature"
    turned: bool = False


_SPEED = OwnVariable("velocity", "speed", "speed")
_SIZE_OF_SPEED = OwnVariable("speed", "size of the speed", "speed", turned=True)
_POSITION = OwnVariable("position", "position", "position")
_TURNED_POSITION = OwnVariable("position", "position", "position", turned=True)
_LOAD = OwnVariable("load", "load", "load")
_TURNED_LOAD = OwnVariable("load", "load", "load", turned=True)
_TRAVEL = OwnVariable("travel", "travel since the last reversal", "position", turned=True)
_ACCELERATION = OwnVariable("acceleration", "acceleration", "acceleration")
_TIME = OwnVariable("time", "time", "time", turned=True)

OWN_VARIABLE: dict[str, OwnVariable] = {
    "viscous": _SPEED,
    "coulomb": _SPEED,
    "offset": _SPEED,
    "viscous-asymmetric": _SPEED,
    "viscous-quadratic": _SIZE_OF_SPEED,
    "viscous-cubic": _SIZE_OF_SPEED,
    "viscous-power": _SIZE_OF_SPEED,
    "stribeck": _SIZE_OF_SPEED,
    "load-friction": _TURNED_LOAD,
    "load-friction-asymmetric": _TURNED_LOAD,
    "load-stribeck": _SIZE_OF_SPEED,
    "friction-position": _TURNED_POSITION,
    "friction-temperature": OwnVariable("temperature", "temperature", "temperature", turned=True),
    "friction-warmup": _TIME,
    "presliding": _TRAVEL,
    "backlash": _TRAVEL,
    "torque-ripple": _POSITION,
    "current-ripple": _POSITION,
    "joint-spring": _POSITION,
    "gain-saturation": _LOAD,
    "drive-gain": _LOAD,
    "delay": _ACCELERATION,
    "elasticity": _ACCELERATION,
    "motor-inertia": _ACCELERATION,
    "coupled-friction": _SPEED,
    "payload-mass": _LOAD,
    "payload-com": _POSITION,
    "gravity-tilt": _POSITION,
}


BY_NAME = {
    "dq": _SPEED,
    "q": _POSITION,
    "ddq": _ACCELERATION,
    "load": _LOAD,
    "time": _TIME,
    "travel since reversal": _TRAVEL,
}
"""Variables as the diagnosis names them, for effects that are not of the catalogue."""


def own_variable(effect: str, variable: str | None = None) -> OwnVariable:
    """The variable of an effect of the catalogue; for a user's own the one that the diagnosis names, else speed."""
    return OWN_VARIABLE.get(effect.split("@")[0]) or BY_NAME.get(variable or "", _SPEED)


def draw_effect_picture(
    before: ErrorBand,
    after: ErrorBand | None,
    variable: str,
    variable_unit: str,
    error_unit: str,
    turned: bool,
    width: float = 590,
    height: float = 262,
) -> Markup:
    """Draw the residual without the effect (grey band, medians as dots) and with it (violet)."""
    left, right, top, bottom = 52.0, width - 10.0, 12.0, height - 38.0
    x = Scale(float(before.centre[0]), float(before.centre[-1]), left, right)
    ends = [np.abs(before.low), np.abs(before.high)]
    ends += [np.abs(after.low), np.abs(after.high)] if after is not None else []
    finite = np.concatenate(ends)
    finite = finite[np.isfinite(finite)]
    reach = float(np.quantile(finite, 0.97)) * 1.25 if finite.size else 1.0
    y = Scale(-reach, reach, bottom, top)

    def vertical(values: np.ndarray) -> np.ndarray:
        return y.array(np.clip(values, y.low, y.high))

    ticks = round_ticks(y.low, y.high, 6)
    content = [line(left, y(tick), right, y(tick), "axis" if tick == 0 else "grid-line") for tick in ticks]
    content += [text(left - 7, y(tick) + 3.8, tick_text(tick, ticks), "end") for tick in ticks]
    ticks = round_ticks(x.low, x.high, 7)
    content += [line(x(tick), bottom, x(tick), bottom + 3, "axis") for tick in ticks]
    content += [text(x(tick), bottom + 15, tick_text(tick, ticks), "middle") for tick in ticks]
    content.append(line(left, bottom, right, bottom, "axis"))
    content.append(area(x.array(before.centre), vertical(before.low), vertical(before.high), "band before"))
    if after is not None:
        content.append(area(x.array(after.centre), vertical(after.low), vertical(after.high), "band"))
    dots = [
        element("circle", cx=float(px), cy=float(py), r=2.3)
        for px, py in zip(x.array(before.centre), vertical(before.median), strict=True)
        if np.isfinite(py)
    ]
    content.append(element("g", "".join(dots), class_="dots before") if dots else "")
    content.append(curve(x.array(before.centre), vertical(before.median), "curve before"))
    if after is not None:
        content.append(curve(x.array(after.centre), vertical(after.median), "curve"))
    content.append(text((left + right) / 2, height - 4, f"{variable}, {variable_unit}", "middle title"))
    words = f"error · sign(q̇), {error_unit}" if turned else f"error, {error_unit}"
    middle = (top + bottom) / 2
    content.append(text(11, middle, words, "middle", transform=f"rotate(-90 11 {middle:g})"))
    return picture(width, height, f"Residual over {variable}, without and with the effect", *content)
