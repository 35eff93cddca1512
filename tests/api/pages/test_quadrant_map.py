"""The map of the error over speed and load: what its cells hold, and their colours."""

import json
import re

import numpy as np

from api.pages.figures.quadrant_map import (
    draw_quadrant_map,
    full_scale,
    map_cells,
    quadrant_map,
    symmetric_edges,
)


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
    cells = re.findall(r'<path d="M([\d.]+) [^"]*" class="([pmz]\d)"', drawing)
    assert [colour for _, colour in sorted(cells, key=lambda cell: float(cell[0]))] == ["p9", "z0"]


def test_what_a_cell_holds_is_told_in_the_order_of_the_loads_with_null_where_it_is_empty() -> None:
    edges = np.array([-1.0, 0.0, 1.0])
    cells = quadrant_map(
        np.repeat([-0.5, 0.5], 4), np.repeat([0.5, -0.5], 4), np.repeat([2.0, -1.0], 4), edges, edges
    )
    told = json.loads(map_cells(cells, "rad/s", "N m"))
    assert told["mean"] == [None, -1.0, 2.0, None]
    assert told["count"] == [0, 4, 4, 0]
    assert told["units"] == ["rad/s", "N m"]


def test_the_colour_scale_holds_nearly_all_cells_and_is_a_round_number() -> None:
    mean = np.concatenate([np.linspace(-1.234, 1.234, 99), [50.0]])
    assert full_scale(mean) == 1.3
