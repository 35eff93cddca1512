"""The band of the error over a variable: percentiles of each interval."""

import xml.etree.ElementTree as ElementTree

import numpy as np

from api.pages.figures.error_band import draw_error_band, error_band, even_edges


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
