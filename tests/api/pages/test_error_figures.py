"""The figures of a model's error, drawn of its numbers."""

import xml.etree.ElementTree as ElementTree
from dataclasses import replace

import numpy as np
import pytest

from api.pages.error_figures import JointUnits, draw_error_figures
from api.pages.error_views import error_views, first_views
from api.pages.joint_samples import JointSamples


@pytest.fixture(scope="module")
def samples() -> JointSamples:
    rng = np.random.default_rng(2)
    time = np.arange(0.0, 40.0, 0.02)
    velocity = np.cos(time)
    measured = 10 * velocity + rng.normal(size=len(time))
    return JointSamples(
        files=("session-00.h5",),
        session=np.zeros(len(time), int),
        time=time,
        position=np.sin(time),
        velocity=velocity,
        acceleration=-np.sin(time),
        load=5 * np.sin(time),
        measured=measured,
        predicted=10 * velocity,
        moving=np.ones(len(time), bool),
        temperature=np.full(len(time), np.nan),
    )


def test_all_models_have_the_scales_of_the_first(samples: JointSamples) -> None:
    first = first_views(samples)
    better = replace(samples, predicted=samples.measured - 0.2 * samples.error)
    views = error_views(better, first.scales)
    np.testing.assert_allclose(views.cells.mean, 0.2 * first.views.cells.mean)
    for name, band in views.bands.items():
        np.testing.assert_array_equal(band.centre, first.views.bands[name].centre)
        np.testing.assert_allclose(band.high, 0.2 * first.views.bands[name].high)
    units = JointUnits.of("revolute")
    drawn = draw_error_figures(views, first.scales, units, [], before=first.views)
    assert drawn.before is not None
    assert drawn.before != drawn.quadrants
    assert draw_error_figures(first.views, first.scales, units, [], before=first.views).before is None


def test_a_joint_that_never_moved_has_empty_figures(samples: JointSamples) -> None:
    first = first_views(samples.where(np.zeros(len(samples.time), bool)))
    drawn = draw_error_figures(first.views, first.scales, JointUnits.of("prismatic"), [])
    for figure in (drawn.quadrants, drawn.correlation, drawn.distribution, *drawn.over):
        assert "nan" not in ElementTree.tostring(ElementTree.fromstring(figure), encoding="unicode")
