"""The zero-phase filter and the parallel filter, against SciPy's forward-backward Butterworth."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.signal import butter, sosfiltfilt

from identify.signals import parallel_filter, zero_phase
from identify.signals.differentiation import differentiate

PART = st.floats(0.01, 0.4)


def forward_backward(columns, part):
    """SciPy's filtfilt with a fourth-order Butterworth, cut-off in parts of the sampling frequency."""
    return sosfiltfilt(butter(4, 2 * part, output="sos"), columns, axis=0, padlen=len(columns) // 3)


@settings(max_examples=40, deadline=None)
@given(part=PART)
def test_the_impulse_response_is_that_of_the_filter_run_to_and_fro(part):
    kernel = zero_phase.impulse_response(part, 1.0)
    half = len(kernel) // 2
    impulse = np.zeros(6 * half + 1)
    impulse[3 * half] = 1.0
    expected = forward_backward(impulse, part)[2 * half : 4 * half + 1]
    np.testing.assert_allclose(kernel, expected, atol=1e-8 * kernel.max())


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


def test_the_filter_is_half_at_its_cutoff_and_loses_nothing_at_a_fifth_of_it():
    gain = zero_phase.response(50.0, 1e-3, np.array([0.0, 10.0, 50.0, 250.0, 500.0]))
    assert gain[0] == 1.0
    assert gain[1] == pytest.approx(1.0, abs=1e-5)
    assert gain[2] == pytest.approx(0.5)
    assert gain[3] < 1e-6
    assert gain[4] < 1e-12


@settings(max_examples=30, deadline=None)
@given(period=st.floats(1e-4, 0.1), part=st.floats(0.02, 0.4), a=st.floats(-3, 3), v=st.floats(-3, 3))
def test_a_parabola_has_its_velocity_and_acceleration(period, part, a, v):
    time = period * np.arange(3001)
    position = (1.0 + v * time + 0.5 * a * time**2)[:, None]
    q, dq, ddq = differentiate(position, period, (part / period,))
    middle = slice(1300, 1700)
    scale = 1 + abs(v) + abs(a) * time[-1]
    np.testing.assert_allclose(dq[middle, 0], (v + a * time)[middle], atol=1e-6 * scale)
    np.testing.assert_allclose(ddq[middle, 0], a, atol=1e-5 * scale / period / 3000)
    smear = np.abs(q[middle] - position[middle]).max()
    assert smear < 1e-6 * (1 + abs(v) * time[-1] + abs(a) * time[-1] ** 2)


@settings(max_examples=200, deadline=None)
@given(least=st.integers(1, 10**7))
def test_lengths_for_the_fourier_transform_are_products_of_small_primes(least):
    length = zero_phase.fast_length(least)
    assert least <= length <= 2 * least
    for prime in (2, 3, 5):
        while length % prime == 0:
            length //= prime
    assert length == 1
