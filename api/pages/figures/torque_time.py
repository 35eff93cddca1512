"""Measured and predicted torque over time with the error beneath, as one still figure for a report (Fig. 4 and 5)."""

from dataclasses import dataclass

import numpy as np
from markupsafe import Markup

from api.pages.figures.drawing import Scale, curve, line, padded_range, picture, round_ticks, text, tick_text
from api.pages.kept_numbers import Numbers
from api.service.envelope import envelope

POINTS = 1500


@dataclass(frozen=True)
class TorqueRows:
    """What is drawn of one session, or of a stretch of it, (points,) each, s and N m or N: samples, or the least and the
    greatest of each piece of time; NaN where a curve breaks.

    without, error_without : of the model compared with; None where there is none
    """

    seconds: Numbers
    measured: Numbers
    predicted: Numbers
    error: Numbers
    without: Numbers | None = None
    error_without: Numbers | None = None


def torque_rows(
    time: np.ndarray, measured: np.ndarray, predicted: np.ndarray, without: np.ndarray | None = None
) -> TorqueRows:
    """Of `time`, `measured`, `predicted` (samples,); s and the torque's unit.

    without : (samples,) of the model compared with, drawn behind with its error
    """
    signals = {"measured": measured, "predicted": predicted, "error": measured - predicted}
    if without is not None:
        signals |= {"without": without, "error_without": measured - without}
    origin, rows = envelope(time, signals, POINTS)
    return TorqueRows(rows[0].astype(float) + origin, **dict(zip(signals, rows[1:], strict=True)))


def draw_torque_rows(
    rows: TorqueRows, label: str, unit: str, width: float = 900, height: float = 330
) -> Markup:
    """Draw torque over time, and the error beneath it; the model compared with behind both."""
    left, right, top, bottom = 58.0, width - 10.0, 8.0, height - 34.0
    split = top + 0.66 * (bottom - top)
    seconds = rows.seconds
    torques = [each for each in (rows.measured, rows.predicted, rows.without) if each is not None]
    of_errors = [each for each in (rows.error, rows.error_without) if each is not None]
    x = Scale(float(seconds[0]), float(seconds[-1]), left, right)
    above = Scale(*padded_range(np.concatenate(torques)), split - 10, top)
    errors = np.abs(np.concatenate(of_errors))
    reach = float(errors[np.isfinite(errors)].max(initial=0.0)) * 1.06 or 1.0
    beneath = Scale(-reach, reach, bottom, split + 8)
    content = []
    for scale, about in ((above, 5), (beneath, 3)):
        ticks = round_ticks(min(scale.low, scale.high), max(scale.low, scale.high), about)
        content += [line(left, scale(tick), right, scale(tick), "grid-line") for tick in ticks]
        content += [text(left - 7, scale(tick) + 3.8, tick_text(tick, ticks), "end") for tick in ticks]
    horizontal = x.array(seconds)
    if rows.without is not None and rows.error_without is not None:
        content.append(curve(horizontal, above.array(rows.without), "curve thin before"))
        content.append(curve(horizontal, beneath.array(rows.error_without), "curve thin before"))
    content.append(curve(horizontal, above.array(rows.measured), "curve thin measured"))
    content.append(curve(horizontal, above.array(rows.predicted), "curve thin predicted"))
    content.append(curve(horizontal, beneath.array(rows.error), "curve thin"))
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
