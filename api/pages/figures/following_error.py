"""The following error of a joint without and with feedforward torque, over the planned position."""

from dataclasses import dataclass

import numpy as np
from markupsafe import Markup

from api.pages.figures.drawing import (
    Scale,
    area,
    curve,
    line,
    padded_range,
    picture,
    round_ticks,
    text,
    tick_text,
)
from api.service.envelope import envelope

POINTS = 900


@dataclass(frozen=True)
class Following:
    """(M,) each: s, errors in the small unit (NaN where there is none), planned position in the unit; limit in the small unit."""

    time: np.ndarray
    before: np.ndarray
    after: np.ndarray
    position: np.ndarray
    limit: float
    small: str
    unit: str


def draw_following_error(joint: str, drawn: Following, width: float = 860, height: float = 330) -> Markup:
    """Draw both errors on one axis, bands from the smallest to the largest of neighbouring cycles, and the position beneath."""
    left, right, top, bottom = 58.0, width - 10.0, 12.0, height - 34.0
    split = top + 0.72 * (bottom - top)
    signals = {"before": drawn.before, "after": drawn.after, "position": drawn.position}
    origin, rows = envelope(drawn.time, signals, POINTS)
    seconds = rows[0].astype(float) + origin
    x = Scale(float(seconds[0]), float(seconds[-1]), left, right)
    errors = np.abs(rows[1:3])
    reach = float(errors[np.isfinite(errors)].max(initial=0.0)) * 1.08 or 1.0
    above = Scale(-reach, reach, split - 12, top)
    beneath = Scale(*padded_range(rows[3]), bottom, split + 6)
    content: list[str] = []
    for scale, about in ((above, 5), (beneath, 3)):
        ticks = round_ticks(min(scale.low, scale.high), max(scale.low, scale.high), about)
        content += [
            line(
                left, scale(tick), right, scale(tick), "axis" if tick == 0 and scale is above else "grid-line"
            )
            for tick in ticks
        ]
        content += [text(left - 7, scale(tick) + 3.8, tick_text(tick, ticks), "end") for tick in ticks]
    for values, kind in ((rows[1], "before"), (rows[2], "")):
        across, low, high = _pairs(seconds, values)
        content.append(area(x.array(across), above.array(low), above.array(high), f"band following {kind}"))
    if drawn.limit < reach:
        content += [
            line(left, above(sign * drawn.limit), right, above(sign * drawn.limit), "limit")
            for sign in (1, -1)
        ]
        content.append(text(right - 4, above(drawn.limit) - 4, "stopped beyond", "end limit-text"))
    across, low, high = _pairs(seconds, rows[3])
    content.append(curve(x.array(across), beneath.array((low + high) / 2), "curve thin position"))
    ticks = round_ticks(x.low, x.high, 10 if width > 500 else 5)
    content += [text(x(tick), bottom + 15, tick_text(tick, ticks), "middle") for tick in ticks]
    content.append(line(left, bottom, right, bottom, "axis"))
    content.append(text((left + right) / 2, height - 4, "time of the plan, s", "middle"))
    for scale, label in ((above, f"error, {drawn.small}"), (beneath, f"plan, {drawn.unit}")):
        middle = (scale.start + scale.end) / 2
        content.append(text(12, middle, label, "middle title", transform=f"rotate(-90 12 {middle:g})"))
    title = f"Following error of {joint} without and with feedforward torque, above the planned position"
    return picture(width, height, title, *content)


def _pairs(seconds: np.ndarray, values: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Times, smallest and largest values of the pairs that an envelope consists of."""
    whole = len(seconds) // 2 * 2
    both = values[:whole].astype(float).reshape(-1, 2)
    return seconds[:whole:2], np.fmin(*both.T), np.fmax(*both.T)
