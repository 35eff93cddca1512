"""Each effect has the picture in which it is obvious, and always the torque of the worst stretch."""

import xml.etree.ElementTree as ElementTree
from dataclasses import replace

import numpy as np
import pytest

from api.pages.effect_pictures import effect_pictures
from api.pages.effect_views import effect_views
from api.pages.error_figures import JointUnits
from api.pages.joint_samples import JointSamples

UNITS = JointUnits.of("revolute")


@pytest.fixture(scope="module")
def before() -> JointSamples:
    """A joint that swings, with a torque that no model knows."""
    rng = np.random.default_rng(5)
    time = np.arange(0.0, 60.0, 0.02)
    position = 1.2 * np.sin(2 * np.pi * time / 8.0)
    velocity = 1.2 * 2 * np.pi / 8.0 * np.cos(2 * np.pi * time / 8.0)
    measured = 10 * np.cos(position) + 3 * np.sign(velocity) + 0.1 * rng.normal(size=len(time))
    return JointSamples(
        files=("session-00.h5",),
        session=np.zeros(len(time), int),
        time=time,
        position=position,
        velocity=velocity,
        acceleration=-((2 * np.pi / 8.0) ** 2) * position,
        load=10 * np.cos(position),
        measured=measured,
        predicted=10 * np.cos(position),
        moving=np.ones(len(time), bool),
        temperature=np.full(len(time), np.nan),
    )


@pytest.fixture(scope="module")
def after(before) -> JointSamples:
    return replace(before, predicted=before.predicted + 3 * np.sign(before.velocity))


@pytest.mark.parametrize(
    ("effect", "constants", "first"),
    [
        ("torque-ripple", {"wave_number": 19.0}, "Residual folded on one period"),
        ("presliding", {"presliding_distance": 0.01}, "Residual as a loop after reversals"),
        ("backlash", {}, "Measured and predicted around reversals"),
        ("delay", {}, "Measured and predicted around reversals"),
        (
            "load-friction",
            {},
            "Loss over load where the motor drives (quadrants 1 and 3), above 10\u202f% of the greatest speed",
        ),
        ("friction-warmup", {}, "Residual over time"),
        ("friction-temperature", {}, "Residual over speed"),  # none was recorded
    ],
)
def test_each_effect_has_its_picture_first_and_the_worst_stretch_last(
    before, after, effect, constants, first
):
    views = effect_views(effect_pictures(effect, before, after, UNITS, None, constants), UNITS)
    assert views[0].words == first
    assert views[-1].words == "Torque where the error is worst, session-00.h5"
    for view in views:
        drawing = ElementTree.fromstring(view.drawing)
        assert drawing.get("aria-label")
        assert "nan" not in view.drawing
        assert 'class="band before"' in view.drawing or "before" in view.drawing


def test_without_a_prediction_each_picture_stands_alone(before):
    for effect in ("torque-ripple", "presliding", "delay", "load-friction"):
        constants = {"wave_number": 19.0} if "ripple" in effect else {}
        for view in effect_views(effect_pictures(effect, before, None, UNITS, None, constants), UNITS):
            ElementTree.fromstring(view.drawing)


def test_no_samples_have_no_pictures(before):
    nothing = before.where(np.zeros(len(before.time), bool))
    assert effect_pictures("delay", nothing, None, UNITS, None, {}) == []


def test_around_reversals_the_samples_at_rest_are_drawn_and_marked(before, after):
    """The joint rests for 0.1 s at each reversal; those samples are not in the fit, and no other picture has them."""
    moving = np.abs(before.velocity) > 0.04
    resting, with_it = replace(before, moving=moving), replace(after, moving=moving)
    around, worst = effect_views(effect_pictures("delay", resting, with_it, UNITS, None, {}), UNITS)
    assert around.resting
    assert 'class="at-rest"' in around.drawing
    assert not worst.resting
    assert not effect_views(effect_pictures("delay", before, after, UNITS, None, {}), UNITS)[0].resting
