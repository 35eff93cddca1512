"""Decimation behind the parallel filter, against SciPy's forward-backward Butterworth."""

import numpy as np
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.signal import butter, sosfiltfilt

from identify.signals import parallel_filter, zero_phase

PART = st.floats(0.01, 0.4)


def forward_backward(columns, part):
    """SciPy's filtfilt with a fourth-order Butterworth, cut-off in parts of the sampling frequency."""
    return sosfiltfilt(butter(4, 2 * part, output="sos"), columns, axis=0, padlen=len(columns) // 3)


@settings(max_examples=40, deadline=None)
@given(
    part=PART,
    factor=st.integers(1, 300),
    k=st.integers(1, 5),
    first=st.integers(0, 200),
    seed=st.integers(0, 99),
)
def test_decimated_samples_are_those_of_the_filtered_record(part, factor, k, first, seed):
    columns = np.random.default_rng(seed).standard_normal((4000, k))
    count = (len(columns) - 1 - first) // factor + 1
    found = parallel_filter.decimate(columns, first, count, factor, part, 1.0)
    expected = forward_backward(columns, part)[first::factor]
    assert found.shape == expected.shape
    rows = first + factor * np.arange(count)
    inside = (rows > 1200) & (rows < 2800)  # SciPy starts its filter at the borders in a way of its own
    np.testing.assert_allclose(found[inside], expected[inside], atol=1e-8)


@settings(max_examples=30, deadline=None)
@given(
    part=PART,
    factor=st.integers(1, 50),
    rows=st.integers(1, 500),
    slope=st.floats(-1, 1),
    level=st.floats(-9, 9),
)
def test_a_straight_line_passes_unchanged_to_its_very_ends(part, factor, rows, slope, level):
    line = level + slope * np.arange(float(rows))
    count = (rows - 1) // factor + 1
    found = parallel_filter.decimate(line[:, None], 0, count, factor, part, 1.0)[:, 0]
    memory = zero_phase.memory(part, 1.0)
    if rows > memory:
        np.testing.assert_allclose(found, line[::factor], atol=1e-6)
    else:
        assert np.isfinite(found).all()
