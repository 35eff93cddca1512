"""Curves with marks and bounds: they lie where their values are, and what is not a number breaks them."""

import re
import xml.etree.ElementTree as ElementTree

import numpy as np

from api.pages.figures.curves import Curve, Marks, draw_curves


def test_a_curve_is_broken_where_it_is_not_a_number_and_a_bound_is_a_line_across() -> None:
    y = np.array([0.0, 1.0, np.nan, 1.0, 0.0])
    drawing = draw_curves(
        "A title", [Curve(np.arange(5.0), y, "before")], "lag, s", "c", Marks(bounds=(0.5, -0.5))
    )
    figure = ElementTree.fromstring(drawing)
    assert figure.get("aria-label") == "A title"
    path = re.search(r'd="([^"]+)"[^>]*class="curve before"', drawing)
    assert path is not None
    assert path[1].count("M") == 2
    assert drawing.count('class="floor"') == 2


def test_a_mark_outside_the_curves_is_left_out_and_one_on_the_right_has_its_words_on_the_left() -> None:
    marks = Marks(at=[(1.0, "left"), (9.0, "right"), (11.0, "outside")])
    drawing = draw_curves("A title", [Curve(np.arange(11.0), np.arange(11.0), "")], "x", "y", marks)
    assert "outside" not in drawing
    assert re.search(r'class="floor-text end"[^>]*>right<', drawing)
    assert re.search(r'class="floor-text "[^>]*>left<', drawing)


def test_bars_stand_on_zero_whatever_their_sign() -> None:
    bars = Curve([0.0, 1.0], [2.0, -2.0], "bar-error")
    drawing = draw_curves("A title", [Curve([0.0, 1.0], [0.0, 0.0], "")], "x", "y", bars=bars)
    above, beneath = (
        {name: float(re.search(rf'{name}="([\d.-]+)"', rect)[1]) for name in ("y", "height")}
        for rect in re.findall(r"<rect[^>]*bar-error[^>]*>", drawing)
    )
    assert above["y"] + above["height"] == beneath["y"]
    assert abs(above["height"] - beneath["height"]) < 0.2


def test_nothing_to_draw_is_an_empty_figure_not_an_error() -> None:
    ElementTree.fromstring(draw_curves("A title", [Curve([0.0, 1.0], [np.nan, np.nan], "")], "x", "y"))
