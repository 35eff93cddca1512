"""The staircase of the models' errors: which versions stand in it, and what is said beneath each."""

import shutil

import pytest

from api.pages import model_steps
from api.pages.figures.step_chart import ModelStep
from api.pages.model_steps import step_chart, step_link
from api.pages.stored_models import StoredExperiment
from api.service.model_story import IDENTIFICATION_FILE, ModelStory
from api.service.model_use import SIMULATION_FILE
from identify.results.identification import IdentificationDocument
from identify.results.reading import read_document
from identify.results.simulation import SimulationDocument
from identify.results.unseen_motion import EffectOnMotion, JointUnseenMotion, UnseenMotionErrors

JOINT = "j3"


@pytest.fixture
def steps(experiments, monkeypatch):
    """What is drawn of the stored versions as they are then."""
    drawn: list[ModelStep] = []

    def draw(shown, floor):
        assert floor == 0.021
        drawn[:] = shown

    monkeypatch.setattr(model_steps, "draw_step_chart", draw)

    def of_now() -> list[ModelStep]:
        step_chart(StoredExperiment(experiments, "experiment"), JOINT, 0.021)
        return list(drawn)

    return of_now


def unseen(position_rms: float, worse: bool, joint: str = JOINT) -> UnseenMotionErrors:
    errors = JointUnseenMotion(
        joint=joint, position_rms=position_rms, position_rms_before=2e-3, unit="rad", worse=worse
    )
    return UnseenMotionErrors(horizon=1.0, unseen="stretches", windows=25, joints=(errors,))


def simulated(motion: UnseenMotionErrors | None) -> str:
    return SimulationDocument(
        experiment="arm", model="usual", effects=(), controller=None, horizons=(), unseen=motion, remarks=()
    ).json_text()


def test_versions_that_stand_come_first_and_the_current_one_is_marked(steps, models):
    shown = steps()
    assert [step.label for step in shown] == ["usual", "+ load-friction-asymmetric", "+ load-stribeck"]
    assert [step.undone for step in shown] == [False, False, True]
    assert [step.current for step in shown] == [False, True, False]
    assert [step.relative_error for step in shown] == pytest.approx(
        [model.relative_error for model in models.values()]
    )
    assert [step.relative_error_validation for step in shown] == pytest.approx(
        [1.06 * step.relative_error for step in shown]
    )
    assert [(step.other_data, step.motion, step.motion_worse) for step in shown] == [(None, None, False)] * 3


@pytest.mark.parametrize(("sessions", "words"), [(1, "of 1 session"), (2, "of 2 sessions")])
def test_an_error_of_other_data_than_the_current_one_s_says_of_how_many_sessions(
    steps, experiments, sessions, words
):
    story = ModelStory(experiments.folder(""))
    shutil.copytree(story.fit_folder("m1"), story.new_fit_folder("m1", "f2"))
    fit = story.read().version("m1").fit
    story.add_fit("m1", fit.model_copy(update={"id": "f2", "data": "changed", "sessions": sessions}))
    assert [step.other_data for step in steps()] == [words, None, None]


def test_a_version_of_which_nothing_was_measured_on_the_joint_is_left_out(steps, experiments):
    stored = StoredExperiment(experiments, "experiment")
    shown = stored.model("m2")
    joints = tuple(each.changed(relative_error=None) for each in shown.document.joints)
    file = shown.folder / IDENTIFICATION_FILE
    file.write_text(read_document(IdentificationDocument, file).changed(joints=joints).json_text())
    assert [step.label for step in steps()] == ["usual", "+ load-stribeck"]


def test_motion_is_that_of_the_version_s_own_simulation_where_there_is_one(steps, experiments):
    stored = StoredExperiment(experiments, "experiment")
    for version, motion in (("m1", unseen(1.5e-3, False)), ("m2", unseen(3e-3, True)), ("m3", None)):
        (stored.model(version).folder / SIMULATION_FILE).write_text(simulated(motion))
    first, second, third = steps()
    assert (first.motion, first.motion_worse) == ("1.5 mrad", False)
    assert (second.motion, second.motion_worse) == ("3 mrad", True)
    assert (third.motion, third.motion_worse) == (None, False)
    (stored.model("m1").folder / SIMULATION_FILE).write_text("{")
    assert steps()[0].motion is None


def test_motion_of_a_step_is_as_the_diagnosis_before_it_found_what_was_added(steps, experiments):
    stored = StoredExperiment(experiments, "experiment")
    diagnosis = stored.models.diagnosis("m1")
    found = [
        EffectOnMotion(effect=effect, joint=JOINT, motion=unseen(rms, worse))
        for effect, rms, worse in (("load-friction-asymmetric", 4e-3, True), ("stribeck", 1e-3, False))
    ]
    stored.models.store_diagnosis("m1", diagnosis.changed(motion=tuple(found)))
    first, second, third = steps()
    assert (second.motion, second.motion_worse) == ("4 mrad", True)
    assert [(step.motion, step.motion_worse) for step in (first, third)] == [(None, False)] * 2
    # its own simulation goes before; what hurts a joint by either is marked
    (stored.model("m2").folder / SIMULATION_FILE).write_text(simulated(unseen(1e-3, False)))
    assert (steps()[1].motion, steps()[1].motion_worse) == ("1 mrad", True)


def test_a_step_is_posted_with_its_joint_and_what_else_it_needs(experiments):
    stored = StoredExperiment(experiments, "an-arm")
    assert step_link(stored, "undo", "j 3") == "/pages/experiments/an-arm/steps/undo?joint=j+3"
    assert step_link(stored, "add", JOINT, effect="a&b") == (
        "/pages/experiments/an-arm/steps/add?joint=j3&effect=a%26b"
    )
