"""Torque over time and its error beneath: what is drawn of each, and on which scale."""

import re

import numpy as np
import pytest

from api.pages.figures.torque_time import POINTS, TorqueRows, draw_torque_rows, torque_rows
from tests.api.pages.path_points import points_of

LEFT, RIGHT, TOP, BOTTOM = 58.0, 890.0, 8.0, 296.0
"""px of a picture of 900 by 330"""
SPLIT = TOP + 0.66 * (BOTTOM - TOP)


def curves(drawing: str) -> list[tuple[str, np.ndarray]]:
    found = re.findall(r'<path d="([^"]+)" class="curve thin ?([^"]*)"', drawing)
    return [(kind, points_of(data)) for data, kind in found]


def test_few_samples_are_drawn_as_they_are_with_the_error_of_each_model():
    time = 100.0 + np.arange(5.0)
    measured, predicted = np.array([1.0, 2, 3, 4, 5]), np.array([1.5, 2, 2, 4, 7])
    rows = torque_rows(time, measured, predicted)
    assert rows.seconds.tolist() == time.tolist()
    assert rows.error == pytest.approx([-0.5, 0.0, 1.0, 0.0, -2.0])
    assert rows.without is None
    assert rows.error_without is None
    beside = torque_rows(time, measured, predicted, measured - 3.0)
    assert beside.without == pytest.approx(measured - 3.0)
    assert beside.error_without == pytest.approx(np.full(5, 3.0))


def test_many_samples_keep_every_peak_within_what_a_figure_shows():
    time = 0.001 * np.arange(40_000)
    measured = np.zeros(40_000)
    measured[[777, 31_111]] = 9.0, -8.0
    rows = torque_rows(time, measured, np.zeros(40_000))
    assert POINTS / 2 < len(rows.seconds) <= 2 * POINTS
    assert (rows.measured.max(), rows.measured.min()) == (9.0, -8.0)
    assert (rows.error.max(), rows.error.min()) == (9.0, -8.0)


@pytest.fixture
def rows() -> TorqueRows:
    second = np.array([10.0, 15.0, 20.0])
    return TorqueRows(
        second, np.array([0.0, 10.0, 5.0]), np.array([1.0, 9.0, 5.0]), np.array([-1.0, 1.0, 0.0])
    )


def test_torque_fills_two_thirds_and_the_error_the_rest_about_its_own_zero(rows):
    drawn = dict(curves(draw_torque_rows(rows, "torque of j1", "N m")))
    assert set(drawn) == {"measured", "predicted", ""}
    for points in drawn.values():
        assert points[:, 0] == pytest.approx([LEFT, (LEFT + RIGHT) / 2, RIGHT], abs=0.15)
    # 0 to 10 N m, widened by 6 % to either side, from SPLIT - 10 up to the top
    low, high = -0.6, 10.6
    above = [SPLIT - 10 + (value - low) / (high - low) * (TOP - SPLIT + 10) for value in (0.0, 10.0, 5.0)]
    assert drawn["measured"][:, 1] == pytest.approx(above, abs=0.15)
    # the error reaches 6 % beyond its largest
    middle, half = (SPLIT + 8 + BOTTOM) / 2, (BOTTOM - SPLIT - 8) / 2
    beneath = [middle - value / 1.06 * half for value in (-1.0, 1.0, 0.0)]
    assert drawn[""][:, 1] == pytest.approx(beneath, abs=0.2)


def test_the_model_compared_with_is_behind_and_widens_both_scales(rows):
    other = TorqueRows(
        rows.seconds, rows.measured, rows.predicted, rows.error, rows.measured - 4.0, np.full(3, 4.0)
    )
    drawn = curves(draw_torque_rows(other, "torque", "N m"))
    assert [kind for kind, _ in drawn] == ["before", "before", "measured", "predicted", ""]
    middle, half = (SPLIT + 8 + BOTTOM) / 2, (BOTTOM - SPLIT - 8) / 2
    assert drawn[1][1][:, 1] == pytest.approx([middle - 4.0 / (4.0 * 1.06) * half] * 3, abs=0.2)
    assert drawn[4][1][:, 1] == pytest.approx(
        [middle - value / 4.24 * half for value in (-1.0, 1.0, 0.0)], abs=0.2
    )


def test_a_break_breaks_the_curve_and_no_error_is_a_line(rows):
    broken = TorqueRows(
        np.arange(5.0), np.array([1.0, 2, np.nan, 2, 1]), np.ones(5), np.array([0.0, 0, np.nan, 0, 0])
    )
    drawing = draw_torque_rows(broken, "torque", "N")
    assert "nan" not in drawing
    measured = re.search(r'<path d="([^"]+)" class="curve thin measured"', drawing)[1]
    assert measured.count("M") == 2
    assert ">torque, N</text>" in drawing
    assert ">error, N</text>" in drawing
