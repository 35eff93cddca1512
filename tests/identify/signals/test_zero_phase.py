"""The zero-phase filter and the parallel filter, against SciPy's forward-backward Butterworth."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.signal import butter, sosfiltfilt

from identify.signals import zero_phase

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


def test_the_filter_is_half_at_its_cutoff_and_loses_nothing_at_a_fifth_of_it():
    gain = zero_phase.response(50.0, 1e-3, np.array([0.0, 10.0, 50.0, 250.0, 500.0]))
    assert gain[0] == 1.0
    assert gain[1] == pytest.approx(1.0, abs=1e-5)
    assert gain[2] == pytest.approx(0.5)
    assert gain[3] < 1e-6
    assert gain[4] < 1e-12


@settings(max_examples=200, deadline=None)
@given(least=st.integers(1, 10**7))
def test_lengths_for_the_fourier_transform_are_products_of_small_primes(least):
    length = zero_phase.fast_length(least)
    assert least <= length <= 2 * least
    for prime in (2, 3, 5):
        while length % prime == 0:
            length //= prime
    assert length == 1
