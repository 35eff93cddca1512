"""The torque of a plan by an identified model, against the closed form of the arm that it was identified from."""

import numpy as np
import pytest

from api.pages.plan_view import plan_view
from api.predicting_model import predicting_model
from daq.excitation.plan_model import PlannedMotion
from identify import load_experiment
from identify.identification import identify
from tests.api.driven_arm import (
    FIRST_MOMENT,
    GRAVITY,
    INERTIA,
    LEVER,
    OFFSET,
    VISCOUS,
    short_plan,
    write_driven_arm,
)

DRY, DRIVING, BACKDRIVING = 18.0, 0.15, 0.08


@pytest.fixture(scope="module")
def experiment(rig, tmp_path_factory):
    folder = tmp_path_factory.mktemp("predicted") / "arm"
    write_driven_arm(folder, rig, dry=DRY, driving=DRIVING, backdriving=BACKDRIVING)
    return load_experiment(folder)


def test_a_load_velocity_model_predicts_the_torque_of_a_plan(rig, experiment):
    payload = rig.payload("disk-3.5")
    model = predicting_model(rig, payload, identify(experiment, "load-velocity").document())
    assert model.is_identified
    motion = PlannedMotion.of(short_plan("down and up"), payload, 0.02)
    q, dq, ddq = (each[:, 0] for each in (motion.q, motion.dq, motion.ddq))
    load = (INERTIA + payload.mass * LEVER**2) * ddq
    load += GRAVITY * (FIRST_MOMENT + payload.mass * LEVER) * np.cos(q)
    share = np.where(load * dq > 0, DRIVING, BACKDRIVING)
    torque = load + (DRY + share * np.abs(load)) * np.sign(dq) + VISCOUS * dq + OFFSET
    moving = np.abs(dq) > 0.05
    off = (model.torque(motion)[:, 0] - torque)[moving]
    assert np.linalg.norm(off) < 0.01 * np.linalg.norm(torque[moving])


@pytest.mark.parametrize(
    ("model", "words", "figures"),
    [
        ("load-velocity", "predicted with the current model", 3),
        ("link-side", "cannot be predicted by a model of torques behind motor and gear", 2),
        (None, "cannot be predicted before a first model", 2),
    ],
)
def test_the_preview_of_a_plan_has_the_torque_or_says_why_not(rig, experiment, model, words, figures):
    document = None if model is None else identify(experiment, model).document()
    view = plan_view(short_plan("down and up"), rig, rig.payload("none"), [], document)
    assert words in view.torque_words
    assert len(view.joints[0].figures) == figures
