"""The map of the error over speed and load, with the four quadrants of the paper's Fig. 2.

In quadrants 1 and 3 the motor drives the load (P_out > 0), in 2 and 4 the load drives the motor. An error that depends on
the power sign shows as a checkerboard; one that depends on speed alone as stripes.
"""

import json
from dataclasses import dataclass

import numpy as np
from markupsafe import Markup

from api.pages.figures.choosable import Axis, Choosable
from api.pages.figures.drawing import Scale, element, line, picture, round_ticks, text, tick_text
from api.pages.kept_numbers import Numbers
from api.pages.number_format import significant

WIDTH, HEIGHT = 430.0, 330.0
LEFT, BESIDE, ABOVE, BENEATH = 46.0, 74.0, 16.0, 36.0
"""Room for the scales around the cells."""
STEPS = 9  # colour steps to either side of zero; the classes p1..p9 and m1..m9 of figures.css


@dataclass(frozen=True)
class QuadrantMap:
    """Mean error per cell and how many samples it is of, (load cells, speed cells) each; NaN where these are too few."""

    velocity_edges: Numbers
    load_edges: Numbers
    mean: Numbers
    count: Numbers


def quadrant_map(
    velocity: np.ndarray,
    load: np.ndarray,
    error: np.ndarray,
    velocity_edges: np.ndarray,
    load_edges: np.ndarray,
    at_least: int = 3,
) -> QuadrantMap:
    """Average `error` (samples,) in the cells of speed and load; cells with under `at_least` samples are empty."""
    shape = (len(load_edges) - 1, len(velocity_edges) - 1)
    column = np.searchsorted(velocity_edges, velocity, side="right") - 1
    row = np.searchsorted(load_edges, load, side="right") - 1
    inside = (column >= 0) & (column < shape[1]) & (row >= 0) & (row < shape[0])
    cell = row[inside] * shape[1] + column[inside]
    count = np.bincount(cell, minlength=shape[0] * shape[1])
    total = np.bincount(cell, weights=error[inside], minlength=shape[0] * shape[1])
    with np.errstate(invalid="ignore", divide="ignore"):
        mean = np.where(count >= at_least, total / count, np.nan)
    return QuadrantMap(velocity_edges, load_edges, mean.reshape(shape), count.reshape(shape))


def symmetric_edges(values: np.ndarray, cells: int) -> np.ndarray:
    """Edges of an even number of equal cells around zero that hold `values`, so that zero is an edge."""
    reach = float(np.quantile(np.abs(values), 0.9995)) if values.size else 1.0
    reach = reach or 1.0
    return np.linspace(-reach, reach, 2 * max(cells // 2, 1) + 1)


def full_scale(mean: np.ndarray) -> float:
    """The error at the end of the colour scale: the 98th percentile of the cells' size, rounded to two digits up."""
    sizes = np.abs(mean[np.isfinite(mean)])
    if not sizes.size or not (reach := float(np.quantile(sizes, 0.98))):
        return 1.0
    unit = 10.0 ** (np.floor(np.log10(reach)) - 1)
    return float(np.ceil(reach / unit) * unit)


def draw_quadrant_map(
    cells: QuadrantMap,
    scale: float,
    velocity_unit: str,
    load_unit: str,
    width: float = WIDTH,
    height: float = HEIGHT,
) -> Markup:
    """Draw the map; `scale` (load_unit) is the end of the colour scale, fixed by the caller over model versions."""
    left, right, top, bottom = LEFT, width - BESIDE, ABOVE, height - BENEATH
    x = Scale(float(cells.velocity_edges[0]), float(cells.velocity_edges[-1]), left, right)
    y = Scale(float(cells.load_edges[0]), float(cells.load_edges[-1]), bottom, top)
    content = [*_cells(cells, scale, x, y)]
    content.append(
        element("rect", x=left, y=top, width=right - left, height=bottom - top, class_="axis", fill="none")
    )
    if x.low < 0 < x.high:
        content.append(line(x(0), top, x(0), bottom, "quadrant"))
    if y.low < 0 < y.high:
        content.append(line(left, y(0), right, y(0), "quadrant"))
    content.append(text(right - 6, top + 14, "1 motor drives", "end on-map"))
    content.append(text(left + 6, top + 14, "2 load drives", "on-map"))
    content.append(text(left + 6, bottom - 7, "3 motor drives", "on-map"))
    content.append(text(right - 6, bottom - 7, "4 load drives", "end on-map"))
    ticks = round_ticks(x.low, x.high, 6)
    content += [text(x(tick), bottom + 15, tick_text(tick, ticks), "middle") for tick in ticks]
    content.append(text((left + right) / 2, height - 4, f"speed, {velocity_unit}", "middle"))
    ticks = round_ticks(y.low, y.high, 6)
    content += [text(left - 7, y(tick) + 3.8, tick_text(tick, ticks), "end") for tick in ticks]
    content.append(
        text(
            11,
            (top + bottom) / 2,
            f"load, {load_unit}",
            "middle",
            transform=f"rotate(-90 11 {(top + bottom) / 2:g})",
        )
    )
    content += _colour_bar(scale, load_unit, right + 20, top, bottom)
    across, up = Axis("velocity", cells.velocity_edges), Axis("load", cells.load_edges)
    axes = Choosable(across, up).axes_json(x, y)
    return picture(width, height, "Mean error over speed and load, by quadrant", *content, axes=axes)


def map_cells(cells: QuadrantMap, velocity_unit: str, load_unit: str) -> str:
    """The cells as JSON, for a page that says what is under the pointer: where they lie in the figure (parts of its width and
    height), edges, and of each cell, row by row from the lowest load, mean and samples; null where it is empty."""
    box = [LEFT / WIDTH, ABOVE / HEIGHT, (WIDTH - BESIDE) / WIDTH, (HEIGHT - BENEATH) / HEIGHT]
    return json.dumps(
        {
            "box": [round(side, 5) for side in box],
            "speed": [float(f"{edge:.4g}") for edge in cells.velocity_edges],
            "load": [float(f"{edge:.4g}") for edge in cells.load_edges],
            "mean": [float(f"{mean:.3g}") if np.isfinite(mean) else None for mean in cells.mean.ravel()],
            "count": cells.count.ravel().tolist(),
            "units": [velocity_unit, load_unit],
        },
        separators=(",", ":"),
    )


def _cells(cells: QuadrantMap, scale: float, x: Scale, y: Scale) -> list[str]:
    """One path for each colour: rectangles, of which neighbours of one colour in a row are one. (A page has few bytes.)"""
    level = np.clip(np.rint(cells.mean / scale * STEPS), -STEPS, STEPS)
    outlines: dict[int, list[str]] = {}
    for row, (low, high) in enumerate(zip(cells.load_edges[:-1], cells.load_edges[1:], strict=True)):
        start = 0
        while start < level.shape[1]:
            stop = start + 1
            while stop < level.shape[1] and level[row, stop] == level[row, start]:
                stop += 1
            if np.isfinite(level[row, start]):
                x0, x1 = x(cells.velocity_edges[start]), x(cells.velocity_edges[stop])
                wide, tall = x1 - x0 + 0.3, y(low) - y(high) + 0.3
                outline = f"M{x0:.1f} {y(high):.1f}h{wide:.1f}v{tall:.1f}h-{wide:.1f}z"
                outlines.setdefault(int(level[row, start]), []).append(outline)
            start = stop
    return [
        element("path", d="".join(parts), class_=level_class(step))
        for step, parts in sorted(outlines.items())
    ]


def level_class(level: int) -> str:
    """Style class of a cell: `p1` … above zero, `m1` … below, `z0` at zero."""
    return f"p{level}" if level > 0 else f"m{-level}" if level < 0 else "z0"


def _colour_bar(scale: float, unit: str, left: float, top: float, bottom: float) -> list[str]:
    """The scale as discrete steps, the same that the cells use."""
    step = (bottom - top) / (2 * STEPS + 1)
    bars = [
        element(
            "rect",
            x=left,
            y=top + (STEPS - level) * step,
            width=10.0,
            height=step + 0.3,
            class_=level_class(level),
        )
        for level in range(-STEPS, STEPS + 1)
    ]
    bars.append(element("rect", x=left, y=top, width=10.0, height=bottom - top, class_="axis", fill="none"))
    middle = (top + bottom) / 2
    bars.append(text(left + 15, top + 8, f"+{significant(scale, 2)}"))
    bars.append(text(left + 15, middle + 4, f"0 {unit}"))
    bars.append(text(left + 15, bottom, f"−{significant(scale, 2)}"))
    return bars
