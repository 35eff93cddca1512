"""The residual without and with an effect: where its curves go, point by point."""

import re

import numpy as np
import pytest

from api.pages.figures.effect_picture import draw_effect_picture
from api.pages.figures.error_band import ErrorBand
from tests.api.pages.path_points import points_of

LEFT, RIGHT, TOP, BOTTOM = 52.0, 580.0, 12.0, 224.0
"""px of a picture of 590 by 262"""


def band(low: float, median: float, high: float, count: int = 9) -> ErrorBand:
    every = np.ones(count)
    return ErrorBand(np.linspace(-1.0, 1.0, count), low * every, median * every, high * every)


def height(value: float, reach: float) -> float:
    """px from the top: zero in the middle."""
    return (TOP + BOTTOM) / 2 - value / reach * (BOTTOM - TOP) / 2


def paths(drawing: str) -> dict[str, np.ndarray]:
    return {kind: points_of(data) for data, kind in re.findall(r'<path d="([^"]+)" class="([^"]+)"', drawing)}


def test_both_bands_and_their_medians_stand_on_one_scale_a_quarter_beyond_them():
    drawing = draw_effect_picture(band(-2.0, 1.0, 4.0), band(-0.5, 0.25, 0.5), "speed", "rad/s", "N m", False)
    drawn = paths(drawing)
    assert set(drawn) == {"band before", "band", "curve before", "curve"}
    reach = 1.25 * 4.0  # the 97th percentile of |low| and |high| of both
    for kind, values in (
        ("curve before", [1.0]),
        ("curve", [0.25]),
        ("band before", [-2.0, 4.0]),
        ("band", [-0.5, 0.5]),
    ):
        across, down = drawn[kind].T
        assert (across.min(), across.max()) == pytest.approx((LEFT, RIGHT), abs=0.1)
        assert sorted({round(each, 1) for each in down}) == pytest.approx(
            sorted(height(value, reach) for value in values), abs=0.1
        )


def test_medians_are_dots_where_there_are_samples_enough():
    before = band(-1.0, 0.5, 1.0)
    before.median[[2, 5]] = np.nan
    drawing = draw_effect_picture(before, None, "load", "N m", "N m", False)
    dots = re.findall(r'<circle cx="([\d.]+)" cy="([\d.]+)" r="2.3"/>', drawing)
    expected = [LEFT + (RIGHT - LEFT) * k / 8 for k in range(9) if k not in (2, 5)]
    assert [float(x) for x, _ in dots] == pytest.approx(expected, abs=0.06)
    assert [float(y) for _, y in dots] == pytest.approx([height(0.5, 1.25)] * 7, abs=0.06)
    assert {"band", "curve"}.isdisjoint(paths(drawing))


def test_what_lies_beyond_is_drawn_at_the_edge():
    before = band(-1.0, 0.5, 1.0, count=100)
    before.high[50], before.median[50] = 50.0, 40.0
    drawn = paths(draw_effect_picture(before, None, "speed", "rad/s", "N m", False))
    assert drawn["curve before"][50] == pytest.approx([LEFT + (RIGHT - LEFT) * 50 / 99, TOP], abs=0.15)


@pytest.mark.parametrize(("turned", "label"), [(True, "error · sign(q̇), N"), (False, "error, N")])
def test_axes_are_named_with_their_units(turned, label):
    drawing = draw_effect_picture(band(-1.0, 0.0, 1.0), None, "travel", "mm", "N", turned)
    assert f">{label}</text>" in drawing
    assert ">travel, mm</text>" in drawing
    assert "Residual over travel, without and with the effect" in drawing


def test_nothing_known_is_an_empty_picture_of_one_unit():
    drawing = draw_effect_picture(band(np.nan, np.nan, np.nan), None, "speed", "rad/s", "N m", False)
    assert "nan" not in drawing
    assert paths(drawing) == {}
    assert ">1.0</text>" in drawing
