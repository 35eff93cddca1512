"""The error over one variable: median and the band from the 10th to the 90th percentile, per interval."""

import itertools
from dataclasses import dataclass

import numpy as np
from markupsafe import Markup

from api.pages.figures.choosable import Choosable
from api.pages.figures.drawing import Scale, area, curve, line, picture, round_ticks, text, tick_text
from api.pages.kept_numbers import Numbers


@dataclass(frozen=True)
class ErrorBand:
    """Centres of the intervals and, in each, the 10th, 50th and 90th percentile of the error (NaN where too few)."""

    centre: Numbers
    low: Numbers
    median: Numbers
    high: Numbers

    @property
    def seen(self) -> tuple[float, float]:
        """Centres of the first and the last interval with samples enough: what is drawn of the variable."""
        known = self.centre[np.isfinite(self.median)]
        ends = known if len(known) > 1 else self.centre
        return float(ends[0]), float(ends[-1])


def error_band(variable: np.ndarray, error: np.ndarray, edges: np.ndarray, at_least: int = 5) -> ErrorBand:
    """Percentiles of `error` in the intervals of `variable` (both (samples,)) between `edges`."""
    order = np.argsort(variable, kind="stable")
    bounds = np.searchsorted(variable[order], edges)
    percentiles = np.full((len(edges) - 1, 3), np.nan)
    for index, (start, stop) in enumerate(itertools.pairwise(bounds)):
        if stop - start >= at_least:
            percentiles[index] = np.quantile(error[order[start:stop]], [0.1, 0.5, 0.9])
    return ErrorBand((edges[:-1] + edges[1:]) / 2, *percentiles.T)


def even_edges(values: np.ndarray, intervals: int = 40) -> np.ndarray:
    """Edges of equal intervals over the range that holds all but a thousandth of `values` at either end."""
    finite = values[np.isfinite(values)]
    low, high = (float(edge) for edge in np.quantile(finite, [0.001, 0.999])) if finite.size else (0.0, 1.0)
    if high <= low:
        low, high = low - 0.5, high + 0.5
    return np.linspace(low, high, intervals + 1)


def draw_error_band(
    band: ErrorBand,
    variable: str,
    unit: str,
    error_unit: str,
    reach: float,
    other: ErrorBand | None = None,
    width: float = 420,
    height: float = 112,
    choosable: Choosable | None = None,
) -> Markup:
    """Draw the band with ±`reach` (error_unit) as the vertical range; `other` is the model compared with, dashed.

    choosable : what its axes are of, where samples can be chosen in it
    """
    left, right, top, bottom = 46.0, width - 8.0, 8.0, height - 32.0
    x = Scale(*band.seen, left, right)
    y = Scale(-reach, reach, bottom, top)
    ticks = round_ticks(-reach, reach, 4)
    content = [
        line(left, y(tick), right, y(tick), "zero-line" if tick == 0 else "grid-line") for tick in ticks
    ]
    content += [text(left - 7, y(tick) + 3.8, tick_text(tick, ticks), "end") for tick in ticks]
    if other is not None:
        content.append(area(x.array(other.centre), _clip(y, other.low), _clip(y, other.high), "band before"))
    content.append(area(x.array(band.centre), _clip(y, band.low), _clip(y, band.high), "band"))
    if other is not None:
        content.append(curve(x.array(other.centre), _clip(y, other.median), "curve before"))
    content.append(curve(x.array(band.centre), _clip(y, band.median), "curve"))
    ticks = round_ticks(x.low, x.high, 6)
    content += [line(x(tick), bottom, x(tick), bottom + 3, "axis") for tick in ticks]
    content += [text(x(tick), bottom + 15, tick_text(tick, ticks), "middle") for tick in ticks]
    content.append(line(left, bottom, right, bottom, "axis"))
    content.append(text((left + right) / 2, height - 3, f"{variable}, {unit}", "middle title"))
    content.append(
        text(
            10,
            (top + bottom) / 2,
            error_unit,
            "middle faint",
            transform=f"rotate(-90 10 {(top + bottom) / 2:g})",
        )
    )
    axes = None if choosable is None else choosable.axes_json(x, y)
    return picture(width, height, f"Error over {variable}: median and 10 to 90 % band", *content, axes=axes)


def _clip(scale: Scale, values: np.ndarray) -> np.ndarray:
    return scale.array(np.clip(values, scale.low, scale.high))
