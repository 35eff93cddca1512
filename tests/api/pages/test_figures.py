"""The figures: what they average, and that what they draw is where it should be."""

import re
import xml.etree.ElementTree as ElementTree

import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from api.pages.figures.drawing import Scale, path_data, round_ticks
from api.pages.figures.error_band import draw_error_band, error_band, even_edges
from api.pages.figures.quadrant_map import draw_quadrant_map, full_scale, quadrant_map, symmetric_edges
from api.pages.figures.step_chart import ModelStep, draw_step_chart


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


def test_the_map_averages_the_error_of_each_cell() -> None:
    velocity = np.array([0.5, 0.5, 0.5, 0.5, -0.5, -0.5, -0.5, -0.5])
    load = np.array([1.0, 1.0, 1.0, 1.0, -1.0, -1.0, -1.0, -1.0])
    error = np.array([1.0, 2.0, 3.0, 4.0, -1.0, -1.0, -1.0, -1.0])
    cells = quadrant_map(velocity, load, error, np.array([-1.0, 0.0, 1.0]), np.array([-2.0, 0.0, 2.0]))
    np.testing.assert_array_equal(cells.mean, [[-1.0, np.nan], [np.nan, 2.5]])


def test_zero_speed_and_zero_load_are_edges_of_the_map_not_middles_of_cells() -> None:
    assert 0.0 in symmetric_edges(np.linspace(-0.3, 1.7, 500), 24)


def test_an_error_beyond_the_scale_takes_its_last_colour_and_no_error_fades() -> None:
    edges = np.array([-1.0, 0.0, 1.0])
    cells = quadrant_map(
        np.repeat([-0.5, 0.5], 8), np.repeat([0.5, 0.5], 8), np.repeat([99.0, 0.0], 8), edges, edges
    )
    drawing = draw_quadrant_map(cells, 1.0, "rad/s", "N m")
    classes = re.findall(r'class="([pmz]\d)"', drawing.split("<rect")[1] + drawing.split("<rect")[2])
    assert classes == ["p9", "z0"]


def test_the_colour_scale_holds_nearly_all_cells_and_is_a_round_number() -> None:
    mean = np.concatenate([np.linspace(-1.234, 1.234, 99), [50.0]])
    assert full_scale(mean) == 1.3


def test_the_band_is_the_percentiles_of_each_interval() -> None:
    rng = np.random.default_rng(3)
    variable, error = rng.uniform(0, 2, 40_000), rng.normal(size=40_000)
    error[variable > 1] += 5
    band = error_band(variable, error, np.array([0.0, 1.0, 2.0]))
    # quantiles of the normal distribution at 10 and 90 %: ∓1.2816
    np.testing.assert_allclose(band.low, [-1.2816, 3.7184], atol=0.04)
    np.testing.assert_allclose(band.median, [0.0, 5.0], atol=0.04)
    np.testing.assert_allclose(band.high, [1.2816, 6.2816], atol=0.04)


def test_an_interval_with_too_few_samples_breaks_the_curve() -> None:
    band = error_band(np.array([0.1] * 20 + [0.9] * 20), np.zeros(40), even_edges(np.array([0.0, 1.0]), 5))
    assert np.isnan(band.median[1:-1]).all()
    drawing = draw_error_band(band, "speed", "rad/s", "N m", 1.0)
    ElementTree.fromstring(drawing)


def test_a_path_is_broken_where_a_point_is_not_finite() -> None:
    assert path_data([0, 1, 2, 3], [1, np.nan, 3, 4]) == "M0.0 1.0M2.0 3.0L3.0 4.0"


def test_the_staircase_descends_by_the_errors_and_draws_the_floor() -> None:
    steps = [
        ModelStep("usual", 0.08),
        ModelStep("+ a", 0.04, current=True),
        ModelStep("+ b", 0.02, undone=True),
    ]
    drawing = draw_step_chart(steps, 0.01)
    root = ElementTree.fromstring(drawing)
    circles = [element for element in root.iter() if element.tag.endswith("circle")]
    heights = [float(circle.get("cy", "nan")) for circle in circles]
    zero = 190.0 - 34.0
    # heights above the axis are in proportion to the errors
    np.testing.assert_allclose((zero - heights[0]) / (zero - heights[1]), 2.0, rtol=0.01)
    np.testing.assert_allclose((zero - heights[0]) / (zero - heights[2]), 4.0, rtol=0.02)
    assert "noise floor 1.00" in drawing


def test_a_scale_may_run_downwards() -> None:
    scale = Scale(0.0, 10.0, 100.0, 0.0)
    assert scale(0.0) == 100.0
    assert scale(2.5) == 75.0
