"""All figures of one joint's error: one fitted model, or two beside each other."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from markupsafe import Markup

from api.pages.error_tables import ErrorRow
from api.pages.error_views import VARIABLES, ErrorViews, FigureScales
from api.pages.figures.choosable import Axis, Choosable
from api.pages.figures.curves import Curve, Marks, draw_curves
from api.pages.figures.error_band import draw_error_band
from api.pages.figures.group_bars import draw_group_bars
from api.pages.figures.quadrant_map import draw_quadrant_map, map_cells


@dataclass(frozen=True)
class JointUnits:
    """Units of a joint's quantities, by whether it turns or slides."""

    position: str
    speed: str
    acceleration: str
    load: str

    @classmethod
    def of(cls, joint_type: str) -> "JointUnits":
        """Units of a `revolute` or a `prismatic` joint."""
        if joint_type == "prismatic":
            return cls("m", "m/s", "m/s²", "N")
        return cls("rad", "rad/s", "rad/s²", "N m")

    def of_dimension(self, dimension: str) -> str:
        """Unit of `time`, `temperature`, `inertia`, or of one of the fields here."""
        given = {"time": "s", "temperature": "°C", "inertia": "kg" if self.load == "N" else "kg m²"}
        return given.get(dimension) or getattr(self, dimension)


@dataclass(frozen=True)
class ErrorFigures:
    """Figures of a model's error, drawn.

    before : the map of the model that it is set beside: the one compared with, else the first; None where that is itself
    cells, cells_before : what the maps' cells hold, as JSON
    """

    quadrants: Markup
    cells: str
    before: Markup | None
    cells_before: str
    correlation: Markup
    distribution: Markup
    over: tuple[Markup, ...]
    payloads: Markup


def draw_error_figures(
    shown: ErrorViews,
    scales: FigureScales,
    units: JointUnits,
    payloads: Sequence[ErrorRow],
    other: ErrorViews | None = None,
    before: ErrorViews | None = None,
) -> ErrorFigures:
    """Draw the error of a model; all of its figures have the scales of the first model, so that one sees the error fade from
    version to version.

    payloads : its errors by payload
    other    : the model that is drawn behind it for comparison
    before   : the one whose map is set beside its own
    """
    over = []
    for variable in VARIABLES:
        name = variable.samples
        choosable = Choosable(Axis(name, scales.bands[name]), Axis("error"))
        behind = None if other is None else other.bands[name]
        over.append(
            draw_error_band(
                shown.bands[name],
                "time in the session" if name == "time" else variable.label,
                units.of_dimension(variable.dimension),
                units.load,
                scales.reach,
                behind,
                choosable=choosable,
            )
        )
    behind = before or shown
    same = np.array_equal(behind.cells.mean, shown.cells.mean, equal_nan=True)
    return ErrorFigures(
        quadrants=draw_quadrant_map(shown.cells, scales.full, units.speed, units.load),
        cells=map_cells(shown.cells, units.speed, units.load),
        before=None if same else draw_quadrant_map(behind.cells, scales.full, units.speed, units.load),
        cells_before=map_cells(behind.cells, units.speed, units.load),
        correlation=_correlation(shown, other),
        distribution=_distribution(shown, units),
        over=tuple(over),
        payloads=draw_group_bars([(row.words, row.errors) for row in payloads], "payload"),
    )


def _correlation(shown: ErrorViews, other: ErrorViews | None) -> Markup:
    """What the error tells of the error a moment later: nothing, where it is noise."""
    curves = [Curve(shown.lag, shown.correlation, "")]
    if other is not None:
        curves.insert(0, Curve(other.lag, other.correlation, "before"))
    return draw_curves(
        "Autocorrelation of the error, with the bounds of white noise",
        curves,
        "lag, s",
        "correlation",
        Marks(bounds=(shown.bound, -shown.bound)),
        width=420,
        height=150,
        choosable=Choosable(Axis("lag"), Axis("correlation")),
    )


def _distribution(shown: ErrorViews, units: JointUnits) -> Markup:
    """How the error is spread, beside a normal distribution of the same deviation."""
    middle = (shown.edges[:-1] + shown.edges[1:]) / 2
    low, high = shown.ends
    return draw_curves(
        "Histogram of the error beside a normal distribution, with the bounds of 95 %",
        [Curve(middle, 100 * shown.normal, "before")],
        f"error, {units.load}",
        "samples, %",
        Marks(at=[(low, "2.5 %"), (high, "97.5 %")]),
        bars=Curve(middle, 100 * shown.share, "bar-error"),
        width=420,
        height=150,
        choosable=Choosable(Axis("error", shown.edges), Axis(None)),
    )
