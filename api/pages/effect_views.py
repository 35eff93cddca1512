"""The pictures of one effect, drawn: on a desk and on a phone."""

from collections.abc import Sequence
from dataclasses import dataclass

from markupsafe import Markup

from api.pages.effect_pictures import BandPicture, CurvePicture, Picture, TorquePicture
from api.pages.error_figures import JointUnits
from api.pages.figures.curves import Curve, Marks, draw_curves
from api.pages.figures.effect_picture import draw_effect_picture
from api.pages.figures.torque_time import draw_torque_rows

WIDE, NARROW = 590.0, 350.0
"""units of a figure's width, on a desk and on a phone"""


@dataclass(frozen=True)
class EffectView:
    """One picture: what it shows, and whether its curves are torques (measured, model) or errors (without, with)."""

    words: str
    drawing: Markup
    torque: bool
    narrow: Markup
    """the same for a phone, where the wide one could not be read"""
    resting: bool = False
    """whether a range is marked in which the joint rests"""


def effect_views(pictures: Sequence[Picture], units: JointUnits) -> list[EffectView]:
    """Each picture drawn."""
    return [
        EffectView(
            each.words,
            _drawn(each, units, WIDE),
            isinstance(each, TorquePicture) or (isinstance(each, CurvePicture) and each.torque),
            _drawn(each, units, NARROW),
            isinstance(each, CurvePicture) and each.resting is not None,
        )
        for each in pictures
    ]


def _drawn(picture: Picture, units: JointUnits, width: float) -> Markup:
    if isinstance(picture, BandPicture):
        return draw_effect_picture(
            picture.before,
            picture.after,
            picture.variable,
            picture.unit,
            units.load,
            picture.turned,
            width,
            200 if picture.low else 262,
        )
    if isinstance(picture, CurvePicture):
        return draw_curves(
            picture.words,
            [Curve(each.x, each.y, each.kind) for each in picture.curves],
            picture.x_label,
            picture.y_label,
            Marks(at=picture.at, resting=picture.resting),
            width=width,
            height=190 if picture.low else 232,
        )
    return draw_torque_rows(picture.rows, picture.quantity, units.load, width, height=250)
