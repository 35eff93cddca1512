"""Motion as a second judge: right effects mend it to what the true plant leaves, wrong ones that help the torque are told.

The plants and the forward dynamics with their true parameters share no code with the identifier.
"""

from __future__ import annotations

import json
import subprocess
import sys
from dataclasses import replace

import numpy as np
import pytest

from identify import load_experiment
from identify.diagnosis import motion_judgement
from identify.diagnosis.diagnosis import diagnose
from identify.estimation.requested_model import requested_model
from identify.identification import identify
from identify.simulation import simulate
from identify.simulation.unseen_motion import UnseenMotion, unseen_motion
from tests.identify.simulation.true_plant import one_second_error
from tests.plants import closed_loop
from tests.plants.single_joint import record, write_experiment


def with_validation(folder, session):
    """The last session is kept from the fit."""
    file = folder / "experiment.yaml"
    text = file.read_text()
    file.write_text(text.replace(f"payload: m{session}}}", f"payload: m{session}, role: validation}}"))
    return load_experiment(folder)


@pytest.mark.parametrize(
    ("effect", "strength"),
    [
        ("stribeck", 1.5),
        ("friction-position", 1.5),
        ("viscous-quadratic", 1.5),
        ("viscous-asymmetric", 1.5),
        ("joint-spring", 1.0),
        ("load-friction", 1.5),
    ],
)
def test_with_the_hidden_effect_motion_is_predicted_nearly_as_with_the_true_parameters(
    effect, strength, tmp_path
):
    recorded = record({effect: strength}, seed=12, duration=24.0, payload_masses=(0.0, 4.0, 2.0))
    experiment = with_validation(write_experiment(tmp_path / "bench", recorded), 2)
    usual = unseen_motion(identify(experiment, "usual").fitted)
    right = unseen_motion(identify(experiment, "usual", [effect]).fitted)
    assert usual is not None
    assert right is not None
    assert right.unseen == "validation"
    true = one_second_error(recorded.sessions[2], 2.0, effect, strength)
    assert right.rms[0] < 2.0 * true < 2.0 * usual.rms[0]
    assert not right.worse_than(usual)[0]
    assert usual.worse_than(right)[0]


@pytest.fixture(scope="module")
def disturbed(tmp_path_factory):
    """An arm in a loop that lacks nothing but has a coloured disturbance, which wrong effects explain in part."""
    drawn = closed_loop.draw_arm(np.random.default_rng(2), delay=0.0, stiction=0.0, duration=16.0)
    arm = replace(drawn, payloads=(0.0, 6.0))
    (sessions,) = closed_loop.simulate([arm])
    return closed_loop.write_arm(tmp_path_factory.mktemp("loop") / "arm", arm, sessions)


def test_a_wrong_effect_that_helps_the_torque_and_hurts_the_motion_is_told(disturbed, monkeypatch):
    known = {}

    def judged_once(fitted):
        """Both documents look at the same two models."""
        effects = tuple(slot.term.key for slot in fitted.slots)
        if effects not in known:
            known[effects] = unseen_motion(fitted)
        return known[effects]

    for module in (sys.modules[unseen_motion.__module__], simulate):
        monkeypatch.setattr(module, "unseen_motion", judged_once)
    experiment = load_experiment(disturbed)
    usual, wider = identify(experiment, "usual"), identify(experiment, "usual", ["friction-position"])
    assert wider.fitted.fit.relative_error < usual.fitted.fit.relative_error
    (term,) = (
        term
        for term in requested_model(usual.fitted.record, "usual", ["friction-position"]).terms
        if term.effect.name == "friction-position"
    )
    (told,) = motion_judgement.effects_on_motion(usual.fitted, [term])
    assert told.motion.worse == (told.joint,)
    assert told.motion.unseen == "stretches"
    (joint,) = told.motion.joints
    assert joint.position_rms > joint.position_rms_before
    document = simulate.simulated(wider, usual, [0.1], free_run=False)
    assert document.unseen is not None
    assert document.unseen.joints[0].worse
    assert len(known) == 2


def test_a_diagnosis_says_what_its_effects_do_to_motion_where_it_is_asked(tmp_path):
    recorded = record({"viscous-asymmetric": 1.5}, seed=3, duration=12.0, payload_masses=(0.0, 4.0))
    experiment = load_experiment(write_experiment(tmp_path / "bench", recorded))
    assert diagnose(experiment).document().motion is None
    motion = diagnose(experiment, motion=True).document().motion
    assert motion is not None
    assert motion[0].effect == "viscous-asymmetric"
    (joint,) = motion[0].motion.joints
    assert joint.position_rms < 0.5 * joint.position_rms_before
    done = subprocess.run(
        [sys.executable, "-m", "api", "improve", str(tmp_path / "bench"), "--motion", "--json"],
        capture_output=True,
        text=True,
        check=True,
    )
    steps = json.loads(done.stdout)["steps"]
    assert [len(step["motion"]["joints"]) for step in steps] == [1] * len(steps)
    assert steps[0]["motion"]["joints"][0]["position_rms_before"] is None
    assert (
        steps[1]["motion"]["joints"][0]["position_rms_before"]
        == steps[0]["motion"]["joints"][0]["position_rms"]
    )


def test_what_windows_leave_in_doubt_is_not_called_worse():
    random = np.random.default_rng(2)
    before = UnseenMotion(random.uniform(1.0, 2.0, (20, 2)), "stretches", 1.0)
    shuffled = UnseenMotion(before.errors + random.normal(0.0, 0.2, (20, 2)), "stretches", 1.0)
    risen = UnseenMotion(before.errors * [1.2, 1.001], "stretches", 1.0)
    assert not shuffled.worse_than(before).any()
    assert risen.worse_than(before).tolist() == [True, False]


def test_sessions_shorter_than_a_window_have_no_figure(disturbed):
    assert unseen_motion(identify(load_experiment(disturbed), "usual").fitted, horizon=60.0) is None
