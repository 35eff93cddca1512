"""All figures and tables of one joint's error: one fitted model, or two beside each other."""

from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
from markupsafe import Markup

from api.pages import error_tables
from api.pages.catalogue_words import picture_of
from api.pages.figures.choosable import Axis, Choosable
from api.pages.figures.curves import Curve, Marks, draw_curves
from api.pages.figures.effect_picture import draw_effect_picture
from api.pages.figures.error_band import ErrorBand, draw_error_band, error_band, even_edges
from api.pages.figures.group_bars import draw_group_bars
from api.pages.figures.quadrant_map import (
    draw_quadrant_map,
    full_scale,
    map_cells,
    quadrant_map,
    symmetric_edges,
)
from api.pages.joint_samples import JointSamples
from identify.effects.picture import OVER_SPEED, PictureVariable
from identify.validation.residual_views import Distribution, autocorrelation, distribution

LONGEST_LAG = 1.0
"""s over which the error is compared with itself"""


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
    """Figures of a model's error, drawn; `scale` is the end of the map's colours in the unit of the load.

    before : the map of the model that it is set beside: the one compared with, else the first; None where that is itself
    cells, cells_before : what the maps' cells hold, as JSON
    histogram_edges : (bins + 1,) of the histogram, in the unit of the load
    """

    quadrants: Markup
    cells: str
    before: Markup | None
    cells_before: str
    correlation: Markup
    distribution: Markup
    histogram_edges: np.ndarray
    over: tuple[Markup, ...]
    payloads: Markup
    scale: float


def error_figures(
    shown: JointSamples,
    first: JointSamples,
    payload_of: Mapping[str, str],
    units: JointUnits,
    other: JointSamples | None = None,
) -> ErrorFigures:
    """Draw the error of `shown`; the scales are those of `first`, the first model of the same joint, so that one sees
    the error fade from version to version. `other` is drawn behind for comparison."""
    # About ten samples a cell where there are few, at most 24 by 18 cells.
    cells_across = int(np.clip(np.sqrt(len(first.time) / 10), 10, 24))
    velocity_edges = symmetric_edges(first.velocity, cells_across)
    load_edges = symmetric_edges(first.load, int(0.75 * cells_across))
    first_map = quadrant_map(first.velocity, first.load, first.error, velocity_edges, load_edges)
    scale = full_scale(first_map.mean)
    cells = quadrant_map(shown.velocity, shown.load, shown.error, velocity_edges, load_edges)
    bands = []
    for name, label, unit in (
        ("velocity", "speed", units.speed),
        ("position", "position", units.position),
        ("load", "load", units.load),
        ("time", "time in the session", "s"),
    ):
        edges = even_edges(getattr(first, name), _intervals(len(first.time)))
        of_first, of_shown, of_other = (
            error_band(getattr(samples, name), samples.error, edges) if samples is not None else None
            for samples in (first, shown, other)
        )
        choosable = Choosable(Axis(name, edges), Axis("error"))
        bands.append((label, unit, choosable, of_first, of_shown, of_other))
    reach = _reach([of_first for _, _, _, of_first, _, _ in bands])
    over = [
        draw_error_band(of_shown, label, unit, units.load, reach, of_other, choosable=choosable)
        for label, unit, choosable, _, of_shown, of_other in bands
    ]
    models = [shown] if other is None else [shown, other]
    payloads = draw_group_bars(
        [(row.words, row.errors) for row in error_tables.by_payload(models, payload_of)], "payload"
    )
    compared = other if other is not None else first
    behind = quadrant_map(compared.velocity, compared.load, compared.error, velocity_edges, load_edges)
    same = compared.error is shown.error or np.array_equal(behind.mean, cells.mean, equal_nan=True)
    spread = distribution(shown.error)
    return ErrorFigures(
        quadrants=draw_quadrant_map(cells, scale, units.speed, units.load),
        cells=map_cells(cells, units.speed, units.load),
        before=None if same else draw_quadrant_map(behind, scale, units.speed, units.load),
        cells_before=map_cells(behind, units.speed, units.load),
        correlation=_correlation(shown, other),
        distribution=_distribution(spread, units),
        histogram_edges=spread.edges,
        over=tuple(over),
        payloads=payloads,
        scale=scale,
    )


def _correlation(shown: JointSamples, other: JointSamples | None) -> Markup:
    """What the error tells of the error a moment later: nothing, where it is noise."""
    of_shown = autocorrelation(shown.session, shown.time, shown.error, LONGEST_LAG)
    curves = [Curve(of_shown.lag, of_shown.value, "")]
    if other is not None:
        behind = autocorrelation(other.session, other.time, other.error, LONGEST_LAG)
        curves.insert(0, Curve(behind.lag, behind.value, "before"))
    return draw_curves(
        "Autocorrelation of the error, with the bounds of white noise",
        curves,
        "lag, s",
        "correlation",
        Marks(bounds=(of_shown.bound, -of_shown.bound)),
        width=420,
        height=150,
        choosable=Choosable(Axis("lag"), Axis("correlation")),
    )


def _distribution(spread: Distribution, units: JointUnits) -> Markup:
    """How the error is spread, beside a normal distribution of the same deviation."""
    middle = (spread.edges[:-1] + spread.edges[1:]) / 2
    low, high = spread.bounds
    return draw_curves(
        "Histogram of the error beside a normal distribution, with the bounds of 95 %",
        [Curve(middle, 100 * spread.normal, "before")],
        f"error, {units.load}",
        "samples, %",
        Marks(at=[(low, "2.5 %"), (high, "97.5 %")]),
        bars=Curve(middle, 100 * spread.share, "bar-error"),
        width=420,
        height=150,
        choosable=Choosable(Axis("error", spread.edges), Axis(None)),
    )


def effect_picture(
    effect: str,
    before: JointSamples,
    after: JointSamples | None,
    units: JointUnits,
    variable: str | None = None,
    width: float = 590,
) -> tuple[Markup, PictureVariable]:
    """The residual over the variable of the effect's picture, without it and (where a fit with it is at hand) with it.

    variable : as the diagnosis names it, for a user's own effect, which the catalogue does not list
    """
    over = picture_of(effect, variable)
    values = getattr(before, over.samples)
    if not np.isfinite(values).any():  # no temperature was recorded
        over = OVER_SPEED
        values = before.velocity
    edges = even_edges(values, _intervals(len(values)))
    band = _band(before, over, edges)
    band_after = _band(after, over, edges) if after is not None else None
    drawn = draw_effect_picture(
        band, band_after, over.label, units.of_dimension(over.dimension), units.load, over.error_turned, width
    )
    return drawn, over


def _intervals(samples: int) -> int:
    """Intervals of a band: about forty samples each where there are few, at most 40."""
    return int(np.clip(samples / 40, 14, 40))


def _band(samples: JointSamples, over: PictureVariable, edges: np.ndarray) -> ErrorBand:
    error = samples.turned_error if over.error_turned else samples.error
    return error_band(getattr(samples, over.samples), error, edges)


def _reach(bands: Sequence[ErrorBand]) -> float:
    """The vertical range of the bands: holds the first model's but for a fiftieth of the intervals."""
    ends = np.concatenate([np.abs(end) for band in bands for end in (band.low, band.high)])
    ends = ends[np.isfinite(ends)]
    return float(np.quantile(ends, 0.98)) * 1.1 if ends.size and ends.any() else 1.0


def part_of_fit(models: Sequence[JointSamples], fitted: Collection[str]) -> list[JointSamples]:
    """The samples of the sessions in `fitted`; all samples where none of those sessions is among them."""
    files = [index for index, file in enumerate(models[0].files) if file in fitted]
    if files and len(files) < len(models[0].files):
        return [samples.where(np.isin(samples.session, files)) for samples in models]
    return list(models)


def tables(
    models: Sequence[JointSamples], payload_of: Mapping[str, str], fitted: Collection[str]
) -> dict[str, list[error_tables.ErrorRow]]:
    """The tables of relative errors, by the name that the template knows.

    fitted : files of the sessions that the fit has used; the others (validation) only stand in the table by session,
             unless nothing else is shown
    """
    used = part_of_fit(models, fitted)
    by_session = error_tables.by_session(models)
    return {
        "speed": error_tables.by_speed(used),
        "power": error_tables.by_power_sign(used),
        "payload": error_tables.by_payload(used, payload_of),
        "session": [
            row if row.words in fitted else replace(row, words=f"{row.words} (validation)")
            for row in by_session
        ],
    }
