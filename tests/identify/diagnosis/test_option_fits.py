"""Many small fits at once against SciPy's bounded least squares, one at a time."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.optimize import lsq_linear

from identify.diagnosis.option_fits import OptionFits, Remainder, fit_options
from identify.effects.admissible import Admissible

SETS, ROWS, COLUMNS = 3, 40, 6


def made(seed: int = 0) -> tuple[np.ndarray, np.ndarray]:
    """(sets, rows, columns) of the training sets and of the rows judged; the last column of both is Y."""
    random = np.random.default_rng(seed)
    scale = np.array([1.0, 10.0, 0.1, 2.0, 1.0, 3.0])
    return tuple(random.standard_normal((SETS, ROWS, COLUMNS)) * scale for _ in range(2))  # type: ignore[return-value]


def remainder(rows: np.ndarray) -> Remainder:
    """What is left of columns when nothing is taken out of them."""
    gram = np.einsum("sri,srj->sij", rows, rows)
    nothing = np.zeros((SETS, 1, COLUMNS))
    return Remainder(lambda one, other: gram[:, one, other], nothing, nothing)


def fits(options, bounds, trained=None, judged=None) -> OptionFits:
    rows, others = made()
    return fit_options(
        remainder(rows if trained is None else trained),
        remainder(others if judged is None else judged),
        [np.array(option, np.intp) for option in options],
        bounds,
    )


def bound(lower, upper, matrix=None, least=None) -> Admissible:
    width = len(lower)
    return Admissible(
        np.array(lower, float),
        np.array(upper, float),
        np.zeros((0, width)) if matrix is None else np.array(matrix, float),
        np.zeros(0) if least is None else np.array(least, float),
    )


INF = np.inf
OPTIONS = [[0], [1], [0, 2], [1, 3], [0, 1, 2], []]


@pytest.mark.parametrize(
    ("lower", "upper"),
    [
        (-INF, INF),
        (0.0, INF),
        (-INF, 0.0),
        (0.05, 0.08),
        (-0.01, 0.01),
    ],
)
def test_every_option_on_every_set_is_the_bounded_least_squares_fit(lower, upper):
    trained, judged = made()
    bounds = [bound([lower] * len(option), [upper] * len(option)) for option in OPTIONS]
    got = fits(OPTIONS, bounds)
    for place, option in enumerate(OPTIONS):
        for s in range(SETS):
            y, z = trained[s, :, -1], judged[s, :, -1]
            if not option:
                values = np.zeros(0)
            else:
                ends = (lower - 1e-15, upper) if np.isfinite(lower) else (lower, upper)
                values = lsq_linear(trained[s][:, option], y, ends, tol=1e-14).x
            left = y - trained[s][:, option] @ values
            seen = judged[s][:, option] @ values
            assert got.gain[s, place] == pytest.approx(y @ y - left @ left, rel=1e-5, abs=1e-5)
            assert got.power[s, place] == pytest.approx(seen @ seen, rel=1e-4, abs=1e-5)
            assert got.error[s, place] == pytest.approx(np.sum((z - seen) ** 2), rel=1e-5)


def test_relations_between_parameters_hold():
    """Two parameters whose sum must be at least five: on the line where it is five, the closed form."""
    trained, _ = made()
    got = fits([[0, 1]], [bound([-INF, -INF], [INF, INF], [[1.0, 1.0]], [5.0])])
    for s in range(SETS):
        one, two, y = trained[s][:, 0], trained[s][:, 1], trained[s][:, -1]
        along = one - two
        first = along @ (y - 5.0 * two) / (along @ along)
        values = np.array([first, 5.0 - first])
        left = y - trained[s][:, [0, 1]] @ values
        assert got.gain[s, 0] == pytest.approx(y @ y - left @ left, rel=1e-6)
    # where the relation holds by itself nothing changes
    free = fits([[0, 2]], [None])
    held = fits([[0, 2]], [bound([-INF, -INF], [INF, INF], [[1.0, 1.0]], [-50.0])])
    np.testing.assert_allclose(held.gain, free.gain)


def test_bounds_of_another_number_of_parameters_bind_nothing():
    free = fits([[0, 2]], [None])
    other = fits([[0, 2]], [bound([5.0], [6.0])])
    np.testing.assert_array_equal(other.gain, free.gain)


def test_a_column_that_is_not_seen_beside_the_base_is_given_nothing():
    """The base takes all but 1e-7 of a column's power: what is left is rounding; of another it leaves 1e-5."""
    trained, judged = made()
    gram = np.einsum("sri,srj->sij", trained, trained)
    for left, seen in ((1e-5, True), (1e-7, False)):
        taken = np.zeros((SETS, 1, COLUMNS))
        taken[:, 0, 0] = np.sqrt((1 - left) * gram[:, 0, 0])
        beside = Remainder(lambda one, other: gram[:, one, other], taken, taken)
        got = fit_options(beside, remainder(judged), [np.array([0])], [None])
        assert bool((got.gain > 0).all()) is seen
        assert bool((got.power > 0).all()) is seen
