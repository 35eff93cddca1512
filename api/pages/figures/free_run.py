"""A free run over time: position and speed of a joint as measured and as models give them, each with the errors beneath."""

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from markupsafe import Markup

from api.pages.figures.drawing import Scale, curve, line, padded_range, picture, round_ticks, text, tick_text
from api.service.free_run_curves import MotionCurves

SMALL = 1e3
"""errors are drawn in mrad or mm"""


@dataclass(frozen=True)
class FreeRun:
    """What is drawn of one joint in one session.

    time             : (points,) s
    position, speed  : in the unit
    unit, small      : rad or m, mrad or mm
    left, left_usual : s, when the runs left the record; None where they did not
    """

    time: np.ndarray
    position: MotionCurves
    speed: MotionCurves
    unit: str
    small: str
    left: float | None = None
    left_usual: float | None = None


@dataclass(frozen=True)
class _Strip:
    """One of the strips over each other: its curves from the back to the front with their classes, its share of the height."""

    label: str
    curves: Sequence[tuple[np.ndarray, str]]
    share: float
    from_zero: bool


def draw_free_run(joint: str, drawn: FreeRun, width: float = 860, height: float = 470) -> Markup:
    """Draw the strips over one axis of time, and mark where the runs left the record."""
    left, right, top, bottom = 58.0, width - 10.0, 14.0, height - 34.0
    time = drawn.time[np.isfinite(drawn.time)]
    x = Scale(float(time[0]), float(time[-1]) if len(time) > 1 else float(time[0]) + 1.0, left, right)
    horizontal = x.array(drawn.time)
    content: list[str] = []
    upper = top
    gap = 14.0
    strips = [*_strips("position", drawn.position, drawn.unit, drawn.small)]
    strips += _strips("speed", drawn.speed, f"{drawn.unit}/s", f"{drawn.small}/s")
    room = bottom - top - gap * (len(strips) - 1)
    for strip in strips:
        lower = upper + strip.share * room
        scale = _scale(strip, lower, upper)
        # Of an error the largest round one within the strip, either way: a zero alone would be no scale.
        ticks = _either_way(scale.high) if strip.from_zero else round_ticks(scale.low, scale.high, 4)
        content += [
            line(
                left,
                scale(tick),
                right,
                scale(tick),
                "axis" if tick == 0 and strip.from_zero else "grid-line",
            )
            for tick in ticks
        ]
        content += [text(left - 7, scale(tick) + 3.8, tick_text(tick, ticks), "end") for tick in ticks]
        for values, kind in strip.curves:
            if np.isfinite(values).any():
                content.append(curve(horizontal, scale.array(values), f"curve thin {kind}"))
        middle = (lower + upper) / 2
        content.append(text(12, middle, strip.label, "middle title", transform=f"rotate(-90 12 {middle:g})"))
        upper = lower + gap
    marks = (
        (drawn.left, "the model leaves the record", "limit", "limit-text"),
        (drawn.left_usual, "the usual model leaves it", "curve before", "faint"),
    )
    for row, (at, label, of_line, of_text) in enumerate(mark for mark in marks if mark[0] is not None):
        across = x(at or 0.0)
        content.append(line(across, top, across, bottom, of_line))
        late = across > (left + right) / 2
        place = across + (-5 if late else 5)
        content.append(text(place, top + 9 + 13 * row, label, f"{'end ' if late else ''}{of_text}"))
    ticks = round_ticks(x.low, x.high, 10 if width > 500 else 5)
    content += [text(x(tick), bottom + 15, tick_text(tick, ticks), "middle") for tick in ticks]
    content.append(line(left, bottom, right, bottom, "axis"))
    content.append(text((left + right) / 2, height - 4, "time into the session, s", "middle"))
    title = f"Position and speed of {joint} over time, measured and simulated from the record's start, with the errors"
    return picture(width, height, title, *content)


def _strips(name: str, curves: MotionCurves, unit: str, small: str) -> tuple[_Strip, _Strip]:
    of_values = [
        (curves.usual, "before"),
        (curves.measured, "measured"),
        (curves.model, "predicted"),
    ]
    of_errors = [(SMALL * curves.error_usual, "before"), (SMALL * curves.error, "")]
    return _Strip(f"{name}, {unit}", of_values, 0.3, False), _Strip(f"error, {small}", of_errors, 0.2, True)


def _either_way(reach: float) -> list[float]:
    """The largest of 1, 2 or 5 times a power of ten up to `reach`, with its negative and zero."""
    power = 10.0 ** math.floor(math.log10(reach))
    tick = power * next(factor for factor in (5, 2, 1) if factor * power <= reach * (1 + 1e-9))
    return [-tick, 0.0, tick]


def _scale(strip: _Strip, lower: float, upper: float) -> Scale:
    every = np.concatenate([values for values, _ in strip.curves])
    if not strip.from_zero:
        return Scale(*padded_range(every), lower, upper)
    reach = float(np.abs(every[np.isfinite(every)]).max(initial=0.0)) * 1.08 or 1.0
    return Scale(-reach, reach, lower, upper)
