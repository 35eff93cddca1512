"""The pictures in which one effect is obvious, as numbers, and always the torque of the stretch where the error is worst.

Which picture an effect has it says itself (`identify.effects.picture`); one with a wave number is folded on its period.
Drawn by `effect_views`.
"""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from api.pages.catalogue_words import picture_of
from api.pages.error_figures import JointUnits
from api.pages.error_tables import LOW_SPEED
from api.pages.error_views import intervals
from api.pages.figures.error_band import ErrorBand, error_band, even_edges
from api.pages.figures.torque_time import TorqueRows, torque_rows
from api.pages.joint_samples import JointSamples
from api.pages.kept_numbers import Numbers
from api.pages.number_format import percent, significant
from identify.effects.picture import OVER_SPEED, PictureVariable
from identify.validation.residual_views import around_reversals, position_spectrum, worst_stretch

WORST_SECONDS = 6.0
"""s of the stretch that is shown: long enough for some reversals, short enough to see what happens at each"""
FOLDS = 36
"""intervals of one period: ten degrees of phase each"""
SPECTRUM_LINES = 300
AROUND = 0.3
"""of the mean time between reversals, shown before and after one"""
REVERSAL_INTERVALS = 48
"""at most, before and after a reversal"""
PRESLIDING = 8.0
"""times the presliding distance that a loop shows"""


@dataclass(frozen=True)
class BandPicture:
    """The residual over a variable, without an effect and, where known, with it.

    turned : whether the error is multiplied by the direction
    low    : whether it is one of several beneath each other
    """

    words: str
    before: ErrorBand
    after: ErrorBand | None
    variable: str
    unit: str
    turned: bool
    low: bool = False


@dataclass(frozen=True)
class PictureCurve:
    """Points (N,) each, and the classes that give colour and dash."""

    x: Numbers
    y: Numbers
    kind: str


@dataclass(frozen=True)
class CurvePicture:
    """Curves on common axes.

    at     : values of x that are marked, each with its words
    torque : whether the curves are torques, not errors
    resting : range of x in which the joint mostly rests, whose samples are not in the fit; None where it does not
    """

    words: str
    curves: list[PictureCurve]
    x_label: str
    y_label: str
    at: list[tuple[float, str]]
    torque: bool = False
    low: bool = False
    resting: tuple[float, float] | None = None


@dataclass(frozen=True)
class TorquePicture:
    """Torque over time, and the error beneath it."""

    words: str
    rows: TorqueRows
    quantity: str


Picture = BandPicture | CurvePicture | TorquePicture


def effect_pictures(
    effect: str,
    before: JointSamples,
    after: JointSamples | None,
    units: JointUnits,
    variable: str | None,
    constants: Mapping[str, float],
) -> list[Picture]:
    """Of the samples without the effect and, where they are at hand, with it; the most telling first. Samples at rest, which
    are not in the fit, are drawn around reversals only.

    variable : as the diagnosis names it, for a user's own effect, which the catalogue does not list
    """
    whole = before, after
    before, after = before.in_fit, None if after is None else after.in_fit
    if not len(before.time):
        return []
    waves = constants.get("wave_number")
    over = picture_of(effect, variable)
    pictures: list[Picture]
    if waves:
        pictures = [_folded(before, after, units, waves), _spectrum(before, after, units, waves)]
    elif over.shape == "quadrants":
        pictures = _by_quadrant(before, after, units)
    elif over.shape == "loop":
        pictures = [_loop(before, after, units, constants.get("presliding_distance"))]
    elif over.shape == "reversals":
        pictures = [_reversals(*whole, units)]
    else:
        pictures = [_over_variable(over, before, after, units)]
    return [*pictures, _worst(before, after, units)]


def _over_variable(
    over: PictureVariable, before: JointSamples, after: JointSamples | None, units: JointUnits
) -> Picture:
    """The residual over the variable of the effect's picture."""
    values = getattr(before, over.samples)
    if not np.isfinite(values).any():  # no temperature was recorded
        over = OVER_SPEED
        values = before.velocity
    edges = even_edges(values, intervals(len(values)))
    bands = [
        None
        if each is None
        else error_band(
            getattr(each, over.samples), each.turned_error if over.error_turned else each.error, edges
        )
        for each in (before, after)
    ]
    assert bands[0] is not None
    unit = units.of_dimension(over.dimension)
    return BandPicture(f"Residual over {over.label}", bands[0], bands[1], over.label, unit, over.error_turned)


def _folded(before: JointSamples, after: JointSamples | None, units: JointUnits, waves: float) -> Picture:
    """The residual over the phase of one wave."""
    edges = np.linspace(0.0, 360.0, FOLDS + 1)
    bands = [
        None if each is None else error_band(np.degrees(waves * each.position) % 360.0, each.error, edges)
        for each in (before, after)
    ]
    assert bands[0] is not None
    way = f"{significant(2 * np.pi / waves * 1e3)} {'mm' if units.position == 'm' else 'mrad'}"
    variable = f"position within one period of {way}"
    return BandPicture("Residual folded on one period", bands[0], bands[1], variable, "°", turned=False)


def _spectrum(before: JointSamples, after: JointSamples | None, units: JointUnits, waves: float) -> Picture:
    """Amplitude over wave numbers up to twice the effect's own, in waves per turn of the joint, or per metre."""
    unit = 2 * np.pi if units.position == "m" else 1.0
    span = float(np.ptp(before.position)) or 1.0
    numbers = np.linspace(min(2 * np.pi * 2.5 / span, 0.5 * waves), 2.0 * waves, SPECTRUM_LINES)
    numbers = np.sort(np.append(numbers, waves))
    curves = [
        PictureCurve(numbers / unit, position_spectrum(each.position, each.error, numbers), kind)
        for each, kind in ((before, "before"), (after, ""))
        if each is not None
    ]
    label = "waves per metre" if units.position == "m" else "waves per turn of the joint"
    return CurvePicture(
        "Spectrum of the residual over position",
        curves,
        label,
        f"amplitude, {units.load}",
        at=[(waves / unit, significant(waves / unit, 3))],
        low=True,
    )


def _by_quadrant(before: JointSamples, after: JointSamples | None, units: JointUnits) -> list[Picture]:
    """Loss over the magnitude of the load, apart for the quadrants in which the motor drives, and the load does.

    Near rest friction follows laws of the speed, which widen the bands at loads that the motion passes slowly: such samples
    are left out where that leaves most of the motion.
    """
    least = LOW_SPEED * float(before.speed.max(initial=0.0))
    faster = float(np.mean(before.speed > least)) > 0.5
    above = f", above {percent(LOW_SPEED, 2)} of the greatest speed" if faster else ""
    edges = even_edges(np.abs(before.load), 24)
    edges[0] = 0.0
    pictures: list[Picture] = []
    for quadrants, sign in (("the motor drives (quadrants 1 and 3)", 1), ("the load drives (2 and 4)", -1)):
        bands: list[ErrorBand | None] = []
        for each in (before, after):
            if each is None:
                bands.append(None)
                continue
            rows = (np.sign(each.load * each.velocity) == sign) & (each.speed > (least if faster else 0.0))
            bands.append(error_band(np.abs(each.load[rows]), each.turned_error[rows], edges))
        assert bands[0] is not None
        title = f"Loss over load where {quadrants}{above}"
        pictures.append(
            BandPicture(title, bands[0], bands[1], "magnitude of the load", units.load, turned=True, low=True)
        )
    return pictures


def _loop(
    before: JointSamples, after: JointSamples | None, units: JointUnits, distance: float | None
) -> Picture:
    """The residual after a reversal, forward from the left and backward from the right: hysteresis shows as a loop."""
    travel = before.travel
    way = PRESLIDING * distance if distance else float(np.quantile(travel, 0.5))
    edges = np.linspace(0.0, way or 1.0, 25)
    small = "mm" if units.position == "m" else "mrad"
    curves = []
    for each, kind in ((before, "before"), (after, "")):
        if each is None:
            continue
        forward, backward = (
            error_band(each.travel[way_there], each.error[way_there], edges, at_least=3)
            for way_there in (each.velocity > 0, each.velocity < 0)
        )
        curves.append(PictureCurve(1e3 * forward.centre, forward.median, kind))
        curves.append(PictureCurve(1e3 * (edges[-1] - backward.centre), backward.median, kind))
    return CurvePicture(
        "Residual as a loop after reversals",
        curves,
        f"travel since the reversal, {small}: forward →, ← backward",
        f"error, {units.load}",
        at=[],
    )


def _reversals(before: JointSamples, after: JointSamples | None, units: JointUnits) -> Picture:
    """Measured and predicted around the mean reversal."""
    turns = max(int(np.sum(np.diff(np.sign(before.in_fit.velocity)) != 0)), 1)
    period = float(np.median(np.diff(before.time))) if len(before.time) > 1 else 1.0
    half = float(np.clip(AROUND * len(before.time) * period / turns, 0.05, 2.0))
    # Intervals narrower than the time between samples would be empty in turn.
    count = int(np.clip(2 * half / period, 4, REVERSAL_INTERVALS))
    at, measured, share = around_reversals(
        before.session,
        before.time,
        before.velocity,
        np.stack([before.measured, before.predicted]),
        half,
        count,
        before.moving,
    )
    alone = after is None
    curves = [
        PictureCurve(at, measured[0], "measured"),
        PictureCurve(at, measured[1], "predicted" if alone else "before"),
    ]
    if after is not None:
        _, predicted, _ = around_reversals(
            after.session, after.time, after.velocity, after.predicted[None], half, count, after.moving
        )
        curves.append(PictureCurve(at, predicted[0], "predicted"))
    resting = at[share < 0.5]
    apart = (at[1] - at[0]) / 2
    return CurvePicture(
        "Measured and predicted around reversals",
        curves,
        "time after the reversal, s",
        f"{_quantity(units)} · direction after it, {units.load}",
        at=[(0.0, "reversal")],
        torque=True,
        resting=(float(resting[0] - apart), float(resting[-1] + apart)) if resting.size else None,
    )


def _worst(before: JointSamples, after: JointSamples | None, units: JointUnits) -> Picture:
    """Torque over time where the error without the effect is largest."""
    rows = worst_stretch(before.session, before.time, before.error, WORST_SECONDS)
    measured, without = before.measured[rows], before.predicted[rows]
    file = before.files[int(before.session[rows.start])]
    if after is not None and len(after.time) == len(before.time):
        drawn = torque_rows(before.time[rows], measured, after.predicted[rows], without)
    else:
        drawn = torque_rows(before.time[rows], measured, without)
    quantity = _quantity(units)
    return TorquePicture(f"{quantity.capitalize()} where the error is worst, {file}", drawn, quantity)


def _quantity(units: JointUnits) -> str:
    return "force" if units.load == "N" else "torque"
