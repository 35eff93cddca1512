"""Quantiles of samples, against NumPy's."""

import numpy as np
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra.numpy import array_shapes, arrays
from numpy.testing import assert_allclose

from identify.recording.quantiles import median, quantile, quantiles

FINITE = st.floats(-1e6, 1e6)
SAMPLES = arrays(float, array_shapes(min_dims=1, max_dims=2, max_side=20), elements=FINITE)


@given(SAMPLES, st.lists(st.floats(0, 1), min_size=1, max_size=5))
def test_quantiles_are_those_of_numpy(values, parts):
    before = values.copy()
    assert_allclose(quantiles(values, parts), np.quantile(values, parts, axis=0), rtol=1e-12, atol=1e-9)
    assert_allclose(quantile(values, parts[0]), np.quantile(values, parts[0], axis=0), rtol=1e-12, atol=1e-9)
    assert (values == before).all()


@given(st.lists(FINITE, min_size=1, max_size=20))
def test_the_median_is_that_of_numpy(values):
    assert_allclose(median(values), np.median(values), rtol=1e-12, atol=1e-9)
