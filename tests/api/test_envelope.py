"""The envelope of a signal draws what the signal draws."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from api.service.envelope import envelope, visible_rows


@given(
    values=arrays(np.float64, st.integers(1, 3000), elements=st.floats(-1e6, 1e6, width=32)),
    points=st.integers(2, 400),
)
def test_no_peak_is_lost_and_no_more_rows_come_than_asked_for(values, points):
    time = 0.002 * np.arange(len(values)) + 1000.0
    origin, rows = envelope(time, {"signal": values}, points)
    assert rows.dtype == np.float32
    assert rows.shape[1] <= max(points, 2)
    assert rows[1].min() == np.float32(values.min())
    assert rows[1].max() == np.float32(values.max())
    assert origin == time[0]
    assert np.all(np.diff(rows[0]) >= 0)
    if len(values) <= points:
        np.testing.assert_array_equal(rows[1], values.astype(np.float32))


@given(count=st.integers(401, 5000), points=st.integers(2, 400))
def test_every_pair_of_rows_holds_the_extremes_of_its_own_stretch_of_time(count, points):
    random = np.random.default_rng(count)
    time, values = np.arange(count, dtype=float), random.normal(size=count)
    _origin, rows = envelope(time, {"signal": values}, points)
    starts = rows[0, 0::2].astype(int)
    for block, start in enumerate(starts):
        stop = starts[block + 1] if block + 1 < len(starts) else count
        assert rows[1, 2 * block] == np.float32(values[start:stop].min())
        assert rows[1, 2 * block + 1] == np.float32(values[start:stop].max())


def test_samples_that_did_not_come_hide_no_others():
    values = np.arange(1000.0)
    values[::3] = np.nan
    values[500:600] = np.nan
    _origin, rows = envelope(np.arange(1000.0), {"signal": values}, 20)
    assert np.nanmin(rows[1]) == 1.0
    assert np.nanmax(rows[1]) == 998.0
    assert np.isnan(rows[1, 10])  # a stretch in which nothing came stays a gap


def test_milliseconds_survive_hours():
    time = 1.7e9 + 0.001 * np.arange(100)
    origin, rows = envelope(time, {"signal": np.zeros(100)}, 200)
    np.testing.assert_allclose(origin + rows[0].astype(float), time, rtol=0, atol=1e-6)


@pytest.mark.parametrize(
    ("start", "end", "expected"),
    [(None, None, slice(0, 10)), (2.5, 4.5, slice(2, 6)), (-5, 100, slice(0, 10)), (20, 30, slice(9, 10))],
)
def test_the_visible_part_has_a_neighbour_on_each_side(start, end, expected):
    assert visible_rows(np.arange(10.0), start, end) == expected
