"""A drive's compensation table over the model's curve: the line through its support points, and what the model gives."""

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


@dataclass(frozen=True)
class TableLine:
    """What is drawn; x in the variable's unit, currents in A.

    points : (k, 2) support points
    line   : (m, 2) what the drive makes of them: straight between, held beyond
    model  : (l, 4) x, median, and both percentiles of what the model gives along the record
    """

    title: str
    x_label: str
    points: Sequence[tuple[float, float]]
    line: Sequence[tuple[float, float]]
    model: Sequence[tuple[float, float, float, float]]


def draw_drive_table(drawn: TableLine, width: float = 620, height: float = 260) -> Markup:
    """Draw the model's median with its band, and the table's line with its support points over it."""
    left, right, top, bottom = 52.0, width - 10.0, 12.0, height - 38.0
    points, along = np.array(drawn.points), np.array(drawn.line)
    model = np.array(drawn.model) if drawn.model else np.zeros((0, 4))
    across = np.concatenate([points[:, 0], along[:, 0], model[:, 0]])
    x = Scale(float(across.min()), float(across.max()), left, right)
    y = Scale(*padded_range(np.concatenate([along[:, 1], model[:, 1:].ravel(), [0.0]])), bottom, top)
    ticks = round_ticks(y.low, y.high, 5)
    content = [line(left, y(tick), right, y(tick), "axis" if tick == 0 else "grid-line") for tick in ticks]
    content += [text(left - 7, y(tick) + 3.8, tick_text(tick, ticks), "end") for tick in ticks]
    ticks = round_ticks(x.low, x.high, 7 if width > 500 else 5)
    content += [text(x(tick), bottom + 15, tick_text(tick, ticks), "middle") for tick in ticks]
    for side in (model[model[:, 0] < 0.0], model[model[:, 0] >= 0.0]):
        if len(side):
            horizontal = x.array(side[:, 0])
            content.append(area(horizontal, y.array(side[:, 2]), y.array(side[:, 3]), "band before"))
            content.append(curve(horizontal, y.array(side[:, 1]), "curve measured"))
    content.append(curve(x.array(along[:, 0]), y.array(along[:, 1]), "curve"))
    content += [
        element("circle", cx=x(float(at)), cy=y(float(value)), r=3.5, class_="node") for at, value in points
    ]
    content.append(line(left, bottom, right, bottom, "axis"))
    content.append(text((left + right) / 2, height - 4, drawn.x_label, "middle title"))
    middle = (top + bottom) / 2
    content.append(text(12, middle, "current, A", "middle title", transform=f"rotate(-90 12 {middle:g})"))
    return picture(width, height, drawn.title, *content)
