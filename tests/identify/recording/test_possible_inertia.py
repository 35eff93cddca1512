"""An inertia that is negative about some axis is no body's; what is only rounded, or states one moment alone, may be."""

import numpy as np
import pytest

from identify.recording.possible_inertia import check_inertia


def of_points(points, masses):
    """XX XY XZ YY YZ ZZ of point masses about the origin, by its definition."""
    square = sum(m * (p @ p * np.eye(3) - np.outer(p, p)) for p, m in zip(points, masses, strict=True))
    return tuple(float(square[i, j]) for i, j in ((0, 0), (0, 1), (0, 2), (1, 1), (1, 2), (2, 2)))


@pytest.mark.parametrize("seed", range(20))
@pytest.mark.parametrize("count", [1, 2, 5])
def test_what_point_masses_have_is_taken_also_when_it_is_rounded(seed, count):
    rng = np.random.default_rng(seed)
    inertia = of_points(rng.uniform(-1, 1, (count, 3)), rng.uniform(0.1, 3, count))
    assert check_inertia(inertia) == inertia
    rounded = tuple(float(f"{value:.4g}") for value in inertia)
    assert check_inertia(rounded) == rounded


@pytest.mark.parametrize("inertia", [(0, 0, 0, 0, 0, 0), (0, 0, 0, 0, 0, 0.02), (0.1, 0, 0, 0, 0, 0)])
def test_one_moment_alone_is_taken(inertia):
    assert check_inertia(inertia) == inertia


@pytest.mark.parametrize(
    "inertia",
    [
        (-1, 0, 0, 1, 0, 1),
        (0, 0, 0, 0, 0, -0.02),
        (1, 2, 0, 1, 0, 1),
        (0, 0.1, 0, 0, 0, 0),
        (-1, 0, 0, -1, 0, -1),
    ],
)
def test_what_is_negative_about_an_axis_is_refused(inertia):
    with pytest.raises(ValueError, match="negative about some axis"):
        check_inertia(inertia)
