"""What a choice of samples is, for every picture of the page: said in words, counted, and as points to draw."""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from fastapi import APIRouter
from numpy.typing import NDArray

from api.pages.error_figures import JointUnits
from api.pages.error_tables import by_payload, sums_of
from api.pages.error_views import LONGEST_LAG
from api.pages.joint_samples import FIGURE_SAMPLES, JointSamples, relative_error
from api.pages.model_figures import error_views_of
from api.pages.number_format import number, percent, significant
from api.pages.rendering import PREFIX
from api.pages.shown_samples import Shown, ShownSamples
from identify.validation.residual_views import autocorrelation

router = APIRouter(prefix=PREFIX, include_in_schema=False)

POINTS = 500
"""of a choice that pictures draw; which they are is told by the extremes of each column and an even spread over the rest"""
DRAWN = ("velocity", "position", "load", "time", "error")
"""Columns that pictures of the page are drawn over."""


@dataclass(frozen=True)
class ChosenView:
    """A choice as the page shows it.

    words, figures : what is chosen; how many samples and their error, in sentences
    points      : column -> values of some of them
    histogram   : their share of all samples in each bin of the page's histogram, %
    correlation : how the error of the chosen samples correlates with itself: `lag` in s, `correlation`; null where too few
                  of them are so far apart
    payloads    : payload -> the relative error of its chosen samples; payloads without any are left out
    """

    words: str
    figures: str
    samples: int
    points: dict[str, list[float]]
    histogram: list[float]
    correlation: dict[str, list[float | None]]
    payloads: dict[str, "ChosenPayload"]


@dataclass(frozen=True)
class ChosenPayload:
    """Relative error of the chosen samples of one payload, and the same in words."""

    error: float
    words: str


@router.get("/experiments/{experiment}/chosen")
def chosen_samples(shown: Shown) -> ChosenView:
    """The samples that the address chooses."""
    if shown.selection is None:
        return ChosenView("", "Nothing is chosen.", 0, {}, [], {}, {})
    samples = shown.stored.samples(shown.model, shown.joint, shown.counted).in_fit
    mask = shown.chosen_of_fit()
    units = shown.columns.units(shown.joint)
    rows = _spread(samples, np.flatnonzero(mask))
    return ChosenView(
        words=shown.selection.words(shown.columns.column),
        figures=_figures(shown, samples, mask, units),
        samples=int(mask.sum()),
        points={name: [float(f"{v:.5g}") for v in getattr(samples, name)[rows].tolist()] for name in DRAWN},
        histogram=_histogram(shown, samples, mask),
        correlation=_correlation(samples, mask),
        payloads=_payloads(samples.where(mask), shown.stored.payload_of),
    )


def _figures(shown: ShownSamples, samples: JointSamples, mask: NDArray[np.bool_], units: JointUnits) -> str:
    count, total = int(mask.sum()), len(mask)
    if not count:
        return "No sample of what is shown here is among them."
    error = samples.error[mask]
    rms = float(np.sqrt(np.mean(error**2)))
    part = relative_error(samples.measured[mask], error)
    sentence = (
        f"{number(count, 0)} of {number(total, 0)} samples. Error of model {shown.model.number}: "
        f"{significant(rms)} {units.load} RMS, {percent(part)} of the torque there"
    )
    if shown.beside is not None:
        behind = shown.stored.samples(shown.beside, shown.joint, shown.counted).in_fit
        if len(behind.time) == total:
            other = float(np.sqrt(np.mean(behind.error[mask] ** 2)))
            sentence += f"; of model {shown.beside.number}: {significant(other)} {units.load} RMS"
    whole = float(np.sqrt(np.mean(samples.error**2)))
    return f"{sentence}. Over all {number(total, 0)}: {significant(whole)} {units.load} RMS."


def _histogram(shown: ShownSamples, samples: JointSamples, mask: NDArray[np.bool_]) -> list[float]:
    edges = error_views_of(shown.stored, shown.model, shown.joint, shown.counted).edges
    count, _ = np.histogram(samples.error[mask], edges)
    return [float(f"{share:.4g}") for share in (100.0 * count / max(len(mask), 1)).tolist()]


def _correlation(samples: JointSamples, mask: NDArray[np.bool_]) -> dict[str, list[float | None]]:
    step = -(-len(mask) // FIGURE_SAMPLES)
    every = slice(None, None, step)
    correlation = autocorrelation(
        samples.session[every], samples.time[every], samples.error[every], LONGEST_LAG, mask[every]
    )
    return {
        "lag": [float(f"{lag:.5g}") for lag in correlation.lag.tolist()],
        "correlation": [
            float(f"{value:.4g}") if np.isfinite(value) else None for value in correlation.value.tolist()
        ],
    }


def _payloads(chosen: JointSamples, payload_of: Mapping[str, str]) -> dict[str, ChosenPayload]:
    return {
        row.words: ChosenPayload(error, f"{percent(error)} of the chosen")
        for row in by_payload([sums_of(chosen)], payload_of, chosen.files)
        if (error := row.errors[0]) is not None
    }


def _spread(samples: JointSamples, chosen: NDArray[np.intp]) -> NDArray[np.intp]:
    """Some of the chosen rows: an even spread, and those with the least and the greatest value of each column."""
    if len(chosen) <= POINTS:
        return chosen
    even = chosen[np.linspace(0, len(chosen) - 1, POINTS - 2 * len(DRAWN)).astype(np.intp)]
    ends = []
    for name in DRAWN:
        values = getattr(samples, name)[chosen]
        ends += [chosen[int(np.argmin(values))], chosen[int(np.argmax(values))]]
    return np.unique(np.concatenate([even, ends]))
