"""Measured and predicted torque over time with the error beneath, as one still figure for a report (Fig. 4 and 5)."""

import numpy as np
from markupsafe import Markup

from api.pages.figures.drawing import Scale, curve, line, padded_range, picture, round_ticks, text, tick_text
from api.service.envelope import envelope

POINTS = 1500


def draw_torque_time(
    time: np.ndarray,
    measured: np.ndarray,
    predicted: np.ndarray,
    label: str,
    unit: str,
    width: float = 900,
    height: float = 330,
    without: np.ndarray | None = None,
    moving: np.ndarray | None = None,
) -> Markup:
    """Draw one session, or a stretch of it: `time`, `measured`, `predicted` (samples,); s and `unit`.

    without : (samples,) of the model compared with, drawn behind with its error
    moving  : (samples,) bool; the error is drawn only there, since at rest dry friction takes any value and no fit uses it
    """
    left, right, top, bottom = 58.0, width - 10.0, 8.0, height - 34.0
    split = top + 0.66 * (bottom - top)
    signals = {"measured": measured, "predicted": predicted, "error": measured - predicted}
    if without is not None:
        signals |= {"without": without, "error without": measured - without}
    if moving is not None:
        signals |= {
            name: np.where(moving, signals[name], np.nan) for name in signals if name.startswith("error")
        }
    origin, rows = envelope(time, signals, POINTS)
    seconds = rows[0].astype(float) + origin
    x = Scale(float(seconds[0]), float(seconds[-1]), left, right)
    above = Scale(*padded_range(np.concatenate([rows[1], rows[2], *rows[4:5]])), split - 10, top)
    errors = np.abs(np.concatenate([rows[3], *rows[5:6]]))
    reach = float(errors[np.isfinite(errors)].max(initial=0.0)) * 1.06 or 1.0
    beneath = Scale(-reach, reach, bottom, split + 8)
    content = []
    for scale, about in ((above, 5), (beneath, 3)):
        ticks = round_ticks(min(scale.low, scale.high), max(scale.low, scale.high), about)
        content += [line(left, scale(tick), right, scale(tick), "grid-line") for tick in ticks]
        content += [text(left - 7, scale(tick) + 3.8, tick_text(tick, ticks), "end") for tick in ticks]
    horizontal = x.array(seconds)
    if without is not None:
        content.append(curve(horizontal, above.array(rows[4]), "curve thin before"))
        content.append(curve(horizontal, beneath.array(rows[5]), "curve thin before"))
    content.append(curve(horizontal, above.array(rows[1]), "curve thin measured"))
    content.append(curve(horizontal, above.array(rows[2]), "curve thin predicted"))
    content.append(curve(horizontal, beneath.array(rows[3]), "curve thin"))
    ticks = round_ticks(x.low, x.high, 10)
    content += [text(x(tick), bottom + 15, tick_text(tick, ticks), "middle") for tick in ticks]
    content.append(line(left, bottom, right, bottom, "axis"))
    content.append(text((left + right) / 2, height - 4, "time, s", "middle"))
    for scale, name in ((above, label), (beneath, "error")):
        middle = (scale.start + scale.end) / 2
        content.append(
            text(12, middle, f"{name}, {unit}", "middle title", transform=f"rotate(-90 12 {middle:g})")
        )
    return picture(width, height, f"{label} measured and predicted, and the error", *content)
