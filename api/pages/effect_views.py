"""The pictures in which one effect is obvious, and always the torque of the stretch where the error is worst.

Which picture an effect has it says itself (`identify.effects.picture`); one with a wave number is folded on its period.
"""

from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np
from markupsafe import Markup

from api.pages.catalogue_words import picture_of
from api.pages.error_figures import JointUnits, effect_picture
from api.pages.figures.curves import Curve, Marks, draw_curves
from api.pages.figures.effect_picture import draw_effect_picture
from api.pages.figures.error_band import error_band, even_edges
from api.pages.figures.torque_time import draw_torque_time
from api.pages.joint_samples import JointSamples
from api.pages.number_format import significant
from identify.validation.residual_views import around_reversals, position_spectrum, worst_stretch

WORST_SECONDS = 6.0
"""s of the stretch that is shown: long enough for some reversals, short enough to see what happens at each"""
FOLDS = 36
"""intervals of one period: ten degrees of phase each"""
SPECTRUM_LINES = 300
AROUND = 0.3
"""of the mean time between reversals, shown before and after one"""
WIDE, NARROW = 590.0, 350.0
"""units of a figure's width, on a desk and on a phone"""
PRESLIDING = 8.0
"""times the presliding distance that a loop shows"""


@dataclass(frozen=True)
class EffectView:
    """One picture: what it shows, and whether its curves are torques (measured, model) or errors (without, with)."""

    words: str
    drawing: Markup
    torque: bool = False
    narrow: Markup | None = None
    """the same for a phone, where the wide one could not be read"""


def effect_views(
    effect: str,
    before: JointSamples,
    after: JointSamples | None,
    units: JointUnits,
    variable: str | None,
    constants: Mapping[str, float],
) -> list[EffectView]:
    """Pictures of the samples without the effect and, where they are at hand, with it; the most telling first."""
    if not len(before.time):
        return []
    wide, narrow = (
        _views(effect, before, after, units, variable, constants, width) for width in (WIDE, NARROW)
    )
    return [replace(view, narrow=other.drawing) for view, other in zip(wide, narrow, strict=True)]


def _views(
    effect: str,
    before: JointSamples,
    after: JointSamples | None,
    units: JointUnits,
    variable: str | None,
    constants: Mapping[str, float],
    width: float,
) -> list[EffectView]:
    waves = constants.get("wave_number")
    shape = picture_of(effect, variable).shape
    if waves:
        views = [_folded(before, after, units, waves, width), _spectrum(before, after, units, waves, width)]
    elif shape == "quadrants":
        views = _by_quadrant(before, after, units, width)
    elif shape == "loop":
        views = [_loop(before, after, units, constants.get("presliding_distance"), width)]
    elif shape == "reversals":
        views = [_reversals(before, after, units, width)]
    else:
        drawing, over = effect_picture(effect, before, after, units, variable, width)
        views = [EffectView(f"Residual over {over.label}", drawing)]
    return [*views, _worst(before, after, units, width)]


def _folded(
    before: JointSamples, after: JointSamples | None, units: JointUnits, waves: float, width: float
) -> EffectView:
    """The residual over the phase of one wave."""
    edges = np.linspace(0.0, 360.0, FOLDS + 1)
    bands = [
        None if each is None else error_band(np.degrees(waves * each.position) % 360.0, each.error, edges)
        for each in (before, after)
    ]
    assert bands[0] is not None
    period = 2 * np.pi / waves
    way = f"{significant(period * 1e3)} {'mm' if units.position == 'm' else 'mrad'}"
    drawing = draw_effect_picture(
        bands[0], bands[1], f"position within one period of {way}", "°", units.load, False, width
    )
    return EffectView("Residual folded on one period", drawing)


def _spectrum(
    before: JointSamples, after: JointSamples | None, units: JointUnits, waves: float, width: float
) -> EffectView:
    """Amplitude over wave numbers up to twice the effect's own, in waves per turn of the joint, or per metre."""
    unit = 2 * np.pi if units.position == "m" else 1.0
    span = float(np.ptp(before.position)) or 1.0
    numbers = np.linspace(min(2 * np.pi * 2.5 / span, 0.5 * waves), 2.0 * waves, SPECTRUM_LINES)
    numbers = np.sort(np.append(numbers, waves))
    curves = [
        Curve(numbers / unit, position_spectrum(each.position, each.error, numbers), kind)
        for each, kind in ((before, "before"), (after, ""))
        if each is not None
    ]
    label = "waves per metre" if units.position == "m" else "waves per turn of the joint"
    marks = Marks(at=[(waves / unit, significant(waves / unit, 3))])
    drawing = draw_curves(
        "Spectrum of the residual over position",
        curves,
        label,
        f"amplitude, {units.load}",
        marks,
        width=width,
        height=190,
    )
    return EffectView("Spectrum of the residual over position", drawing)


def _by_quadrant(
    before: JointSamples, after: JointSamples | None, units: JointUnits, width: float
) -> list[EffectView]:
    """Loss over the magnitude of the load, apart for the quadrants in which the motor drives, and the load does."""
    edges = even_edges(np.abs(before.load), 24)
    edges[0] = 0.0
    views = []
    for quadrants, sign in (("the motor drives (quadrants 1 and 3)", 1), ("the load drives (2 and 4)", -1)):
        bands = []
        for each in (before, after):
            if each is None:
                bands.append(None)
                continue
            part = each.where(np.sign(each.load * each.velocity) == sign)
            bands.append(error_band(np.abs(part.load), part.turned_error, edges))
        drawing = draw_effect_picture(
            bands[0], bands[1], "magnitude of the load", units.load, units.load, True, width, 200
        )
        views.append(EffectView(f"Loss over load where {quadrants}", drawing))
    return views


def _loop(
    before: JointSamples, after: JointSamples | None, units: JointUnits, distance: float | None, width: float
) -> EffectView:
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
        curves.append(Curve(1e3 * forward.centre, forward.median, kind))
        curves.append(Curve(1e3 * (edges[-1] - backward.centre), backward.median, kind))
    label = f"travel since the reversal, {small}: forward →, ← backward"
    drawing = draw_curves(
        "Residual as a loop after reversals", curves, label, f"error, {units.load}", width=width
    )
    return EffectView("Residual as a loop after reversals", drawing)


def _reversals(
    before: JointSamples, after: JointSamples | None, units: JointUnits, width: float
) -> EffectView:
    """Measured and predicted around the mean reversal."""
    turns = max(int(np.sum(np.diff(np.sign(before.velocity)) != 0)), 1)
    half = float(np.clip(AROUND * len(before.time) * np.median(np.diff(before.time)) / turns, 0.05, 2.0))
    at, measured = around_reversals(
        before.session, before.time, before.velocity, np.stack([before.measured, before.predicted]), half
    )
    curves = [Curve(at, measured[0], "measured"), Curve(at, measured[1], "before")]
    if after is not None:
        _, predicted = around_reversals(
            after.session, after.time, after.velocity, after.predicted[None], half
        )
        curves.append(Curve(at, predicted[0], "predicted"))
    quantity = "force" if units.load == "N" else "torque"
    drawing = draw_curves(
        "Measured and predicted around reversals",
        curves,
        "time after the reversal, s",
        f"{quantity} · direction after it, {units.load}",
        Marks(at=[(0.0, "reversal")]),
        width=width,
    )
    return EffectView("Measured and predicted around reversals", drawing, torque=True)


def _worst(before: JointSamples, after: JointSamples | None, units: JointUnits, width: float) -> EffectView:
    """Torque over time where the error without the effect is largest."""
    rows = worst_stretch(before.session, before.time, before.error, WORST_SECONDS)
    part = before.where(np.arange(rows.start, rows.stop))
    behind = None
    if after is not None and len(after.time) == len(before.time):
        behind = after.predicted[rows]
    file = before.files[int(part.session[0])]
    quantity = "force" if units.load == "N" else "torque"
    drawing = draw_torque_time(
        part.time,
        part.measured,
        part.predicted if behind is None else behind,
        quantity,
        units.load,
        width=width,
        height=250,
        without=None if behind is None else part.predicted,
    )
    return EffectView(f"{quantity.capitalize()} where the error is worst, {file}", drawing, torque=True)
