"""How finely a model's error is looked at, and on which scales: those of the first model."""

from dataclasses import replace

import numpy as np
import pytest

from api.pages.error_views import error_views, first_views, intervals
from api.pages.joint_samples import JointSamples


def swinging(count: int) -> JointSamples:
    """Evenly spread speed, load, position and error."""
    time = 0.02 * np.arange(count)
    ramp = np.linspace(-1.0, 1.0, count)
    return JointSamples(
        files=("a.csv",),
        session=np.zeros(count, int),
        time=time,
        position=ramp,
        velocity=ramp,
        acceleration=ramp,
        load=10.0 * ramp,
        measured=3.0 * np.cos(7.0 * time),
        predicted=np.zeros(count),
        moving=np.ones(count, bool),
        temperature=np.full(count, np.nan),
    )


# An even number of cells about zero: sqrt(N / 10) across, within 10 and 24, and three quarters of it up.
@pytest.mark.parametrize(
    ("samples", "across", "up"),
    [(300, 10, 6), (1000, 10, 6), (2560, 16, 12), (5760, 24, 18), (20_000, 24, 18)],
)
def test_a_cell_has_about_ten_samples_and_there_are_no_more_than_24_by_18(samples, across, up):
    scales = first_views(swinging(samples)).scales
    assert (len(scales.velocity_edges) - 1, len(scales.load_edges) - 1) == (across, up)


@pytest.mark.parametrize(("samples", "expected"), [(0, 14), (560, 14), (800, 20), (1600, 40), (100_000, 40)])
def test_an_interval_has_about_forty_samples(samples, expected):
    assert intervals(samples) == expected


def test_the_bands_reach_a_tenth_beyond_all_but_a_fiftieth_of_their_ends():
    first = first_views(swinging(4000))
    ends = [np.abs(end) for band in first.views.bands.values() for end in (band.low, band.high)]
    sizes = np.sort(np.concatenate(ends))
    assert first.scales.reach == pytest.approx(1.1 * np.percentile(sizes[np.isfinite(sizes)], 98))
    assert 2.0 < first.scales.reach < 3.3


def test_a_joint_without_samples_has_scales_of_one():
    nothing = first_views(swinging(100).where(np.zeros(100, bool)))
    assert (nothing.scales.full, nothing.scales.reach) == (1.0, 1.0)


def test_another_model_is_seen_on_the_first_one_s_scales():
    samples = swinging(4000)
    first = first_views(samples)
    half = error_views(replace(samples, predicted=0.5 * samples.measured), first.scales)
    for name, band in half.bands.items():
        np.testing.assert_allclose(band.median, 0.5 * first.views.bands[name].median, atol=1e-12)
    np.testing.assert_allclose(half.ends, 0.5 * np.array(first.views.ends))
    # a cosine's error with itself a second later is its cosine
    np.testing.assert_allclose(half.correlation, np.cos(7.0 * half.lag), atol=0.03)
    assert half.lag[-1] == pytest.approx(1.0, abs=0.021)


def test_the_key_changes_with_the_intervals_and_with_nothing_else():
    first = first_views(swinging(4000)).scales
    assert first.key == replace(first, full=7.0, reach=9.0).key
    assert first.key != replace(first, load_edges=2.0 * first.load_edges).key
    assert first.key != replace(first, bands=first.bands | {"time": first.bands["time"] + 1.0}).key
    assert len(first.key) == 16
