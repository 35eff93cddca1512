"""Scales, ticks and paths: what is drawn is where it should be."""

import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from api.pages.figures.drawing import Scale, path_data, round_ticks
from tests.api.pages.path_points import points_of


@given(
    low=st.floats(-1e6, 1e6),
    span=st.floats(1e-3, 1e6),
    about=st.integers(2, 10),
)
def test_ticks_lie_inside_are_evenly_spaced_and_about_as_many(low: float, span: float, about: int) -> None:
    ticks = round_ticks(low, low + span, about)
    assert all(low - 1e-6 * span <= tick <= low + span * (1 + 1e-6) for tick in ticks)
    assert len(ticks) <= about + 2
    if len(ticks) > 2:
        steps = np.diff(ticks)
        np.testing.assert_allclose(steps, steps[0], rtol=1e-6, atol=1e-9 * abs(low))


def test_a_path_is_broken_where_a_point_is_not_finite() -> None:
    assert path_data([0, 1, 2, 3], [1, np.nan, 3, 4]) == "M0 1M2 3l1 1"


@given(
    points=st.lists(
        st.tuples(st.floats(-1e4, 1e4), st.floats(-1e4, 1e4) | st.just(float("nan"))), min_size=1, max_size=40
    )
)
def test_a_path_goes_through_every_point_to_a_tenth_of_a_pixel(points: list[tuple[float, float]]) -> None:
    x, y = np.array(points).T
    kept = np.isfinite(y)
    drawn = points_of(path_data(x, y))
    np.testing.assert_allclose(drawn, np.column_stack([x, y])[kept], atol=0.0501)


def test_a_scale_may_run_downwards() -> None:
    scale = Scale(0.0, 10.0, 100.0, 0.0)
    assert scale(0.0) == 100.0
    assert scale(2.5) == 75.0
