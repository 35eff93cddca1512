"""The figure of a drive's table: the line through its points over the model's curve."""

import re

import pytest

from api.pages.figures.drive_table import TableLine, draw_drive_table
from tests.api.pages.path_points import points_of


def test_both_lines_are_drawn_to_one_scale_and_the_models_is_not_joined_over_standstill() -> None:
    model = [
        (-20.0, -2.0, -2.5, -1.5),
        (-10.0, -1.0, -1.5, -0.5),
        (10.0, 1.0, 0.5, 1.5),
        (20.0, 2.0, 1.5, 2.5),
    ]
    line = [(-20.0, -2.0), (0.0, 0.0), (20.0, 2.0)]
    drawing = draw_drive_table(TableLine("title", "speed", [line[0], line[2]], line, model))
    (table,) = re.findall(r'<path d="([^"]+)" class="curve"/>', drawing)
    halves = re.findall(r'<path d="([^"]+)" class="curve measured"/>', drawing)
    assert len(halves) == 2
    assert points_of(halves[0])[0] == pytest.approx(points_of(table)[0])
    assert points_of(halves[1])[-1] == pytest.approx(points_of(table)[-1])
    assert len(re.findall("<circle", drawing)) == 2


def test_a_table_without_a_curve_is_drawn_too() -> None:
    assert "<circle" in draw_drive_table(TableLine("t", "x", [(0.0, 1.0)], [(0.0, 1.0), (1.0, 1.0)], ()))
