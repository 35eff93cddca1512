"""Running extremes are those of SciPy."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.ndimage import maximum_filter1d, minimum_filter1d

from identify.signals.running_extremes import running_maximum, running_minimum


@given(st.integers(1, 200), st.integers(0, 30), st.integers(1, 3), st.integers(0, 1000))
def test_they_are_those_of_scipy_whatever_the_lengths(count, half, columns, seed):
    values = np.random.default_rng(seed).standard_normal((count, columns))
    width = 2 * half + 1
    np.testing.assert_array_equal(
        running_maximum(values, width), maximum_filter1d(values, width, axis=0, mode="nearest")
    )
    np.testing.assert_array_equal(
        running_minimum(values, width), minimum_filter1d(values, width, axis=0, mode="nearest")
    )


def test_an_even_width_has_no_middle():
    with pytest.raises(ValueError, match="odd"):
        running_maximum(np.zeros(5), 4)
