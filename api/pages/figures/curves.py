"""A few curves over one variable, with marks and bounds: loops, spectra, correlations, what happens around a reversal."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from markupsafe import Markup
from numpy.typing import ArrayLike

from api.pages.figures.choosable import Choosable
from api.pages.figures.drawing import (
    Scale,
    curve,
    element,
    line,
    padded_range,
    picture,
    round_ticks,
    text,
    tick_text,
)


@dataclass(frozen=True)
class Curve:
    """Points (N,) each, and the classes that give colour and dash."""

    x: ArrayLike
    y: ArrayLike
    kind: str


@dataclass(frozen=True)
class Marks:
    """Lines across a figure: at values of x with words, and bounds at values of y; and a range of x in which the joint rests."""

    at: Sequence[tuple[float, str]] = ()
    bounds: Sequence[float] = ()
    resting: tuple[float, float] | None = None


def draw_curves(
    title: str,
    curves: Sequence[Curve],
    x_label: str,
    y_label: str,
    marks: Marks = Marks(),
    bars: Curve | None = None,
    width: float = 590,
    height: float = 232,
    choosable: Choosable | None = None,
) -> Markup:
    """Draw curves on common axes; `title` is what a screen reader says, `bars` stand on zero behind the curves.

    choosable : what its axes are of, where samples can be chosen in it
    """
    left, right, top, bottom = 52.0, width - 10.0, 14.0, height - 38.0
    drawn = [*curves, *([bars] if bars is not None else [])]
    across = np.concatenate([np.asarray(each.x, float) for each in drawn])
    up = np.concatenate(
        [*(np.asarray(each.y, float) for each in drawn), np.asarray(marks.bounds, float), [0.0]]
    )
    x = Scale(*_range(across, 0.0), left, right)
    y = Scale(*_range(up, 0.06), bottom, top)
    ticks = round_ticks(y.low, y.high, 5)
    content = [line(left, y(tick), right, y(tick), "axis" if tick == 0 else "grid-line") for tick in ticks]
    content += [text(left - 7, y(tick) + 3.8, tick_text(tick, ticks), "end") for tick in ticks]
    ticks = round_ticks(x.low, x.high, 7)
    content += [text(x(tick), bottom + 15, tick_text(tick, ticks), "middle") for tick in ticks]
    content.append(line(left, bottom, right, bottom, "axis"))
    if marks.resting is not None:
        ends = [min(max(x(end), left), right) for end in marks.resting]
        content.append(
            element("rect", x=ends[0], y=top, width=ends[1] - ends[0], height=bottom - top, class_="at-rest")
        )
    if bars is not None:
        content += _bars(bars, x, y)
    content += [line(left, y(bound), right, y(bound), "floor") for bound in marks.bounds]
    for value, label in marks.at:
        if x.low <= value <= x.high:
            content.append(line(x(value), top, x(value), bottom, "floor"))
            side = "end" if value > (x.low + x.high) / 2 else ""
            content.append(text(x(value) + (-5 if side else 5), top + 9, label, f"floor-text {side}"))
    content += [curve(x.array(each.x), y.array(each.y), f"curve {each.kind}") for each in curves]
    content.append(text((left + right) / 2, height - 4, x_label, "middle title"))
    middle = (top + bottom) / 2
    content.append(text(11, middle, y_label, "middle", transform=f"rotate(-90 11 {middle:g})"))
    axes = None if choosable is None else choosable.axes_json(x, y)
    return picture(width, height, title, *content, axes=axes)


def _range(values: np.ndarray, margin: float) -> tuple[float, float]:
    finite = values[np.isfinite(values)]
    if not finite.size:
        return 0.0, 1.0
    if margin:
        return padded_range(finite, margin)
    low, high = float(finite.min()), float(finite.max())
    return (low, high) if high > low else (low - 0.5, high + 0.5)


def _bars(bars: Curve, x: Scale, y: Scale) -> list[str]:
    at, size = x.array(bars.x), np.asarray(bars.y, float)
    wide = float(np.median(np.diff(at))) if len(at) > 1 else 4.0
    return [
        element(
            "rect",
            x=float(middle) - wide / 2,
            y=min(y(value), y(0.0)),
            width=max(wide - 0.6, 0.6),
            height=abs(y(0.0) - y(value)),
            class_=bars.kind,
        )
        for middle, value in zip(at, size.tolist(), strict=True)
    ]
