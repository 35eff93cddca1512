"""The residual over the variable that an effect acts through: what a model without it leaves, and what is left with it.

A friction effect changes sign with the velocity; its error is turned by sign(q̇) first, so that loss shows above zero and
both directions fall on one curve.
"""

import numpy as np
from markupsafe import Markup

from api.pages.figures.drawing import Scale, area, curve, element, line, picture, round_ticks, text, tick_text
from api.pages.figures.error_band import ErrorBand


def draw_effect_picture(
    before: ErrorBand,
    after: ErrorBand | None,
    variable: str,
    variable_unit: str,
    error_unit: str,
    error_turned: bool,
    width: float = 590,
    height: float = 262,
) -> Markup:
    """Draw the residual without the effect (grey band, medians as dots) and with it (violet)."""
    left, right, top, bottom = 52.0, width - 10.0, 12.0, height - 38.0
    x = Scale(*before.seen, left, right)
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
    label = f"error · sign(q̇), {error_unit}" if error_turned else f"error, {error_unit}"
    middle = (top + bottom) / 2
    content.append(text(11, middle, label, "middle", transform=f"rotate(-90 11 {middle:g})"))
    return picture(width, height, f"Residual over {variable}, without and with the effect", *content)
