"""What the figures of a model's error show, as numbers: computed from its samples, drawn by `error_figures`."""

import hashlib
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from api.pages.figures.error_band import ErrorBand, error_band, even_edges
from api.pages.figures.quadrant_map import QuadrantMap, full_scale, quadrant_map, symmetric_edges
from api.pages.joint_samples import JointSamples
from api.pages.kept_numbers import Numbers
from identify.effects.picture import OVER_LOAD, OVER_POSITION, OVER_SPEED, OVER_TIME
from identify.validation.residual_views import autocorrelation, distribution

LONGEST_LAG = 1.0
"""s over which the error is compared with itself"""
VARIABLES = (OVER_SPEED, OVER_POSITION, OVER_LOAD, OVER_TIME)
"""that the error is drawn over"""


@dataclass(frozen=True)
class FigureScales:
    """The scales of all figures of a joint, which are those of the first model.

    full  : error at the end of the map's colours, in the unit of the load
    bands : by the variable's name of the samples, the edges of its intervals
    reach : error at the end of the bands' axes, in the unit of the load
    """

    velocity_edges: Numbers
    load_edges: Numbers
    full: float
    bands: dict[str, Numbers]
    reach: float

    @property
    def key(self) -> str:
        """A text that changes when the intervals do."""
        edges = [self.velocity_edges, self.load_edges, *self.bands.values()]
        return hashlib.sha256(b"".join(each.tobytes() for each in edges)).hexdigest()[:16]


@dataclass(frozen=True)
class ErrorViews:
    """What is seen of a model's error on given scales.

    bands : by the variable's name of the samples
    lag, correlation, bound : of the error with itself, (lags,) s and 1; what white noise stays within
    edges, share, normal, ends : the histogram, (bins + 1,) and (bins,), beside a normal distribution, and the 2.5th and the
                                 97.5th percentile
    """

    cells: QuadrantMap
    bands: dict[str, ErrorBand]
    lag: Numbers
    correlation: Numbers
    bound: float
    edges: Numbers
    share: Numbers
    normal: Numbers
    ends: tuple[float, float]


@dataclass(frozen=True)
class FirstViews:
    """The first model's, and the scales that follow from them."""

    scales: FigureScales
    views: ErrorViews


def first_views(first: JointSamples) -> FirstViews:
    """Of the samples of the first model's fit."""
    # About ten samples a cell where there are few, at most 24 by 18 cells.
    cells_across = int(np.clip(np.sqrt(len(first.time) / 10), 10, 24))
    scales = FigureScales(
        velocity_edges=symmetric_edges(first.velocity, cells_across),
        load_edges=symmetric_edges(first.load, int(0.75 * cells_across)),
        full=1.0,
        bands={
            each.samples: even_edges(getattr(first, each.samples), intervals(len(first.time)))
            for each in VARIABLES
        },
        reach=1.0,
    )
    views = error_views(first, scales)
    full, reach = full_scale(views.cells.mean), _reach(list(views.bands.values()))
    return FirstViews(replace(scales, full=full, reach=reach), views)


def error_views(shown: JointSamples, scales: FigureScales) -> ErrorViews:
    """Of the samples of a model's fit."""
    correlation = autocorrelation(shown.session, shown.time, shown.error, LONGEST_LAG)
    spread = distribution(shown.error)
    return ErrorViews(
        cells=quadrant_map(shown.velocity, shown.load, shown.error, scales.velocity_edges, scales.load_edges),
        bands={
            name: error_band(getattr(shown, name), shown.error, edges) for name, edges in scales.bands.items()
        },
        lag=correlation.lag,
        correlation=correlation.value,
        bound=correlation.bound,
        edges=spread.edges,
        share=spread.share,
        normal=spread.normal,
        ends=spread.bounds,
    )


def intervals(samples: int) -> int:
    """Intervals of a band: about forty samples each where there are few, at most 40."""
    return int(np.clip(samples / 40, 14, 40))


def _reach(bands: Sequence[ErrorBand]) -> float:
    """The vertical range of the bands: holds the first model's but for a fiftieth of the intervals."""
    ends = np.concatenate([np.abs(end) for band in bands for end in (band.low, band.high)])
    ends = ends[np.isfinite(ends)]
    return float(np.quantile(ends, 0.98)) * 1.1 if ends.size and ends.any() else 1.0
