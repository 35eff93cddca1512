"""A planned signal against its limits: where the curve, the limits and what lies beyond them are drawn."""

import re

import numpy as np
import pytest

from api.pages.figures.plan_preview import draw_plan_signal, tick_label
from tests.api.pages.path_points import points_of

LEFT, RIGHT, TOP, BOTTOM = 52.0, 742.0, 10.0, 114.0
"""px of a picture of 800 by 142"""
TIME = np.array([0.0, 5.0, 10.0])


def down(value: float, low: float, high: float) -> float:
    """px from the top of a value on the scale, which is 8 % wider than from low to high to either side."""
    margin = 0.08 * (high - low)
    return BOTTOM - (value - low + margin) / (high - low + 2 * margin) * (BOTTOM - TOP)


def shaded(drawing: str) -> list[tuple[float, float]]:
    """Upper and lower edge of what is shaded."""
    found = re.findall(r'<rect x="52" y="([\d.]+)" width="690" height="([\d.]+)" class="over"/>', drawing)
    return [(float(y), float(y) + float(height)) for y, height in found]


def limits(drawing: str) -> list[float]:
    return [float(y) for y in re.findall(r'y1="([\d.]+)" x2="742" y2="\1" class="limit"', drawing)]


def test_a_signal_within_its_limits_is_drawn_between_them_and_what_lies_beyond_is_shaded():
    drawing = draw_plan_signal(TIME, np.array([-1.0, 0.0, 1.5]), (-2.0, 3.0), "speed", "rad/s", "planned")
    (data,) = re.findall(r'<path d="([^"]+)" class="curve thin planned"', drawing)
    across, drawn = points_of(data).T
    assert across == pytest.approx([LEFT, (LEFT + RIGHT) / 2, RIGHT], abs=0.15)
    assert drawn == pytest.approx([down(value, -2.0, 3.0) for value in (-1.0, 0.0, 1.5)], abs=0.15)
    upper, lower = down(3.0, -2.0, 3.0), down(-2.0, -2.0, 3.0)
    assert limits(drawing) == pytest.approx([upper, lower], abs=0.06)
    assert shaded(drawing) == [pytest.approx((TOP, upper), abs=0.1), pytest.approx((lower, BOTTOM), abs=0.1)]
    assert re.findall(r'class="limit-text">([^<]+)<', drawing) == ["3.0", "−2.0"]
    assert ">speed, rad/s</text>" in drawing


def test_a_signal_beyond_its_limit_is_seen_within_what_is_shaded():
    drawing = draw_plan_signal(TIME, np.array([0.0, 4.0, 0.0]), (None, 3.0), "current", "A", "planned")
    (upper,) = limits(drawing)
    assert upper == pytest.approx(down(3.0, 0.0, 4.0), abs=0.06)
    ((top, bottom),) = shaded(drawing)
    assert top < down(4.0, 0.0, 4.0) < bottom == pytest.approx(upper, abs=0.1)


def test_without_limits_nothing_is_shaded():
    drawing = draw_plan_signal(TIME, np.array([0.0, 4.0, 0.0]), (None, None), "current", "A", "planned")
    assert (shaded(drawing), limits(drawing)) == ([], [])


def test_a_plan_of_no_length_is_drawn_over_a_second():
    drawing = draw_plan_signal(np.zeros(1), np.ones(1), (None, None), "current", "A", "planned")
    assert "nan" not in drawing
    assert ">1.0</text>" in drawing


@pytest.mark.parametrize(
    ("value", "label"),
    [
        (0.0, "0"),
        (3.0, "3.0"),
        (-1.25, "−1.2"),
        (12.6, "13"),
        (0.0123, "0.012"),
        (150.0, "150"),
        (9.96, "10.0"),
    ],
)
def test_a_limit_has_two_significant_digits(value, label):
    assert tick_label(value) == label
