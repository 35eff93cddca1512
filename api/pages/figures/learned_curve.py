"""A torque that was learned over one variable: its support points with their deviations, above what the model leaves there."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from markupsafe import Markup

from api.pages.figures.drawing import (
    Scale,
    area,
    curve,
    element,
    line,
    padded_range,
    picture,
    round_ticks,
    text,
    tick_text,
)
from api.pages.figures.error_band import ErrorBand


@dataclass(frozen=True)
class LearnedCurve:
    """Support points of one direction of motion, or of both alike.

    at, value, deviation : (points,); the deviation is NaN where it is not known
    kind : class of the curve; empty or `predicted`, which is dashed
    """

    at: np.ndarray
    value: np.ndarray
    deviation: np.ndarray
    kind: str


def draw_learned_curve(
    curves: Sequence[LearnedCurve],
    left_over: ErrorBand | None,
    variable: str,
    unit: str,
    torque_unit: str,
    width: float = 590,
    height: float = 232,
) -> Markup:
    """Draw the curves with bars of two deviations to either side; `left_over` is what the model leaves, None: not drawn."""
    left, right, top, bottom = 52.0, width - 10.0, 12.0, height - 38.0
    knots = curves[0].at
    ends = [each.value for each in curves]
    ends += [each.value + side * np.nan_to_num(2 * each.deviation) for each in curves for side in (-1, 1)]
    if left_over is not None:
        ends += [left_over.low, left_over.high]
    x = Scale(float(knots[0]), float(knots[-1]), left + 8, right - 8)
    y = Scale(*padded_range(np.concatenate(ends), include_zero=True), bottom, top)
    ticks = round_ticks(y.low, y.high, 5)
    content = [line(left, y(tick), right, y(tick), "axis" if tick == 0 else "grid-line") for tick in ticks]
    content += [text(left - 7, y(tick) + 3.8, tick_text(tick, ticks), "end") for tick in ticks]
    ticks = round_ticks(x.low, x.high, 7)
    content += [text(x(tick), bottom + 15, tick_text(tick, ticks), "middle") for tick in ticks]
    content.append(line(left, bottom, right, bottom, "axis"))
    if left_over is not None:
        inside = (left_over.centre >= x.low) & (left_over.centre <= x.high)
        low, high = (np.where(inside, each, np.nan) for each in (left_over.low, left_over.high))
        content.append(area(x.array(left_over.centre), y.array(low), y.array(high), "band before"))
    for each in curves:
        content.append(curve(x.array(each.at), y.array(each.value), f"curve {each.kind}"))
        content.append(element("g", "".join(_points(each, x, y)), class_="dots"))
    content.append(text((left + right) / 2, height - 4, f"{variable}, {unit}", "middle title"))
    middle = (top + bottom) / 2
    quantity = "force" if torque_unit == "N" else "torque"
    label = f"{quantity}, {torque_unit}"
    content.append(text(11, middle, label, "middle", transform=f"rotate(-90 11 {middle:g})"))
    return picture(width, height, f"Learned {quantity} over {variable}, with its support points", *content)


def _points(each: LearnedCurve, x: Scale, y: Scale) -> list[str]:
    """The support points, each with its bar."""
    drawn = []
    for at, value, deviation in zip(each.at, each.value, each.deviation, strict=True):
        if np.isfinite(deviation) and deviation > 0:
            drawn.append(line(x(at), y(value - 2 * deviation), x(at), y(value + 2 * deviation), "deviation"))
        drawn.append(element("circle", cx=float(x(at)), cy=float(y(value)), r=3.0))
    return drawn
