"""The figure of a proof: both errors to one scale, the bound where it is within reach, the plan beneath."""

import re

import numpy as np
import pytest

from api.pages.figures.following_error import Following, draw_following_error
from tests.api.pages.path_points import points_of


@pytest.mark.parametrize("limit", [1.5, 30.0])
def test_both_errors_are_drawn_to_one_scale_and_the_bound_only_where_it_can_be_seen(limit: float) -> None:
    time = np.arange(0.0, 4.0, 0.002)
    swing = np.sin(6.0 * time)
    after = 0.5 * swing
    after[:10] = np.nan
    drawing = draw_following_error(
        "j2", Following(time, 2.0 * swing, after, 0.3 * swing, limit, "mrad", "rad")
    )
    bands = re.findall(r'<path d="([^"]+)" class="band following ?(before|)"', drawing)
    assert [kind for _, kind in bands] == ["before", ""]
    heights = [np.ptp(points_of(data)[:, 1]) for data, _ in bands]
    np.testing.assert_allclose(heights[0] / heights[1], 4.0, rtol=0.03)
    assert ("stopped beyond" in drawing) == (limit < 2.0)
    assert "error, mrad" in drawing
    assert "plan, rad" in drawing


def test_the_plan_is_one_line_that_does_not_go_back_and_forth_on_a_slope() -> None:
    time = np.arange(0.0, 30.0, 0.002)
    error = 0.1 * np.sin(time)
    drawing = draw_following_error("j1", Following(time, error, error, 0.4 * time, 9.0, "mrad", "rad"))
    (path,) = re.findall(r'<path d="([^"]+)" class="curve thin position"', drawing)
    points = points_of(path)
    assert len(points) > 100
    assert (np.diff(points[:, 0]) > 0).all()
    assert (np.diff(points[:, 1]) < 0).all()
