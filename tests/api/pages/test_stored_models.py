"""The stored models of an experiment: versions by their place and words, and the samples of their fits."""

import json
from dataclasses import replace

import numpy as np
import pytest

from api.pages import joint_samples
from api.pages.stored_models import StoredExperiment
from api.service.model_story import ModelStory
from api.service.prediction_files import prediction_file, write_candidate
from api.service.problems import Problem
from identify.results.identification import JointSpeedError, SpeedError

JOINT = "j3"


@pytest.fixture
def stored(experiments) -> StoredExperiment:
    return StoredExperiment(experiments, "experiment")


def test_versions_are_counted_from_one_and_called_after_the_effect_that_made_them(stored):
    shown = [stored.model(each.id) for each in stored.story.versions]
    assert [each.number for each in shown] == [1, 2, 3]
    assert [each.words for each in shown] == [
        "usual",
        f"+ load-friction-asymmetric@{JOINT}",
        f"+ load-stribeck@{JOINT}",
    ]
    version = shown[1].version.model_copy(update={"cause": "effect removed"})
    assert replace(shown[1], version=version).words == f"− load-friction-asymmetric@{JOINT}"
    # the third was undone
    assert stored.require_current().number == 2
    with pytest.raises(Problem) as unknown:
        stored.model("m9")
    assert unknown.value.status == 404


def test_each_joint_has_its_own_number_of_samples(stored):
    """The document's is over all joints."""
    shown = stored.model(stored.story.versions[0].id)
    assert shown.samples_of(JOINT) == shown.document.samples
    of_joint = {"relative_error": 0.1, "relative_error_validation": None}
    document = shown.document.model_copy(
        update={
            "samples": 300,
            "joints": (*shown.document.joints, shown.document.joints[0].model_copy(update={"joint": "j4"})),
            "speeds": (
                SpeedError(
                    range="all",
                    from_=0.0,
                    to=1.0,
                    samples=300,
                    joints=(
                        JointSpeedError(joint=JOINT, samples=180, **of_joint),
                        JointSpeedError(joint="j4", samples=120, **of_joint),
                    ),
                    **of_joint,
                ),
            ),
        }
    )
    assert [replace(shown, document=document).samples_of(name) for name in (JOINT, "j4")] == [180, 120]
    without = document.model_copy(update={"speeds": ()})
    assert replace(shown, document=without).samples_of("j4") == 150


def test_before_the_first_fit_there_is_no_current_version(experiments):
    (ModelStory(experiments.folder("")).folder / "story.json").unlink()
    without = StoredExperiment(experiments, "experiment")
    assert without.current() is None
    with pytest.raises(Problem, match="no model yet") as refused:
        without.require_current()
    assert refused.value.status == 409


def test_a_joint_is_the_one_asked_for_or_the_first(stored):
    assert (stored.joint_or_first(None), stored.joint_or_first(JOINT)) == (JOINT, JOINT)
    for wrong in ("", "j9"):
        with pytest.raises(Problem, match=f"it has {JOINT}") as unknown:
            stored.joint_or_first(wrong)
        assert unknown.value.status == 404


def test_files_of_a_fit_are_told_from_those_it_was_only_checked_on_and_those_it_has_not_seen(
    stored, experiments
):
    first, second, third = stored.payload_of
    file = stored.model("m1").folder / "identification.json"
    document = json.loads(file.read_text())
    document["sessions"] = document["sessions"][
        1::-1
    ]  # the third was added later; two others in another order
    document["sessions"][0]["role"] = "validation"
    file.write_text(json.dumps(document))
    shown = stored.model("m1")
    assert [entry.file for entry in shown.document.sessions] == [second, first]
    assert stored.fitted_files(shown) == [first, second]
    assert stored.files_of_fit(shown) == {first}
    document["sessions"] = [entry | {"file": f"gone-{entry['file']}"} for entry in document["sessions"]]
    file.write_text(json.dumps(document))
    assert stored.fitted_files(stored.model("m1")) == [first, second, third]


def test_sessions_that_only_check_or_are_excluded_are_not_of_identification(stored, experiments):
    first, second, third = stored.payload_of
    file = experiments.folder("") / "experiment.yaml"
    text = file.read_text()
    for name, more in ((second, "  role: validation\n"), (third, "  excluded: the belt slipped\n")):
        text = text.replace(f"- file: {name}\n", f"- file: {name}\n{more}")
    file.write_text(text)
    changed = StoredExperiment(experiments, "experiment")
    assert changed.identification_files == {first}
    assert list(changed.payload_of) == [first, second, third]


def test_samples_follow_one_another_in_the_order_asked_for(stored, models):
    shown, (first, _, third) = stored.model("m2"), stored.payload_of
    samples = stored.samples(shown, JOINT, [third, first])
    fitted = models["with load"]
    rows = [fitted._rows(file) for file in (third, first)]
    assert samples.files == (third, first)
    assert samples.session.tolist() == [0] * rows[0].sum() + [1] * rows[1].sum()
    np.testing.assert_array_equal(samples.predicted, np.concatenate([fitted.fitted[each] for each in rows]))
    np.testing.assert_array_equal(
        samples.load, np.concatenate([fitted.motion["load"][each] for each in rows])
    )
    assert stored.samples(shown, JOINT, [third, first]) is samples
    assert stored.samples(shown, JOINT, [first, third]) is not samples


def test_figures_have_every_few_of_the_samples(stored, monkeypatch):
    shown, files = stored.model("m1"), list(stored.payload_of)
    whole = stored.figure_samples(shown, JOINT, files)
    np.testing.assert_array_equal(whole.measured, stored.samples(shown, JOINT, files).measured)
    every_few = joint_samples.every_few
    monkeypatch.setattr("api.pages.stored_models.every_few", lambda lengths: every_few(lengths, 4500))
    few = stored.figure_samples(shown, JOINT, files)
    np.testing.assert_array_equal(few.measured, whole.measured[::4])


def test_a_candidate_is_shown_where_every_file_has_it(stored):
    shown, (first, second, third) = stored.model("m1"), stored.payload_of
    for place in (0, 2):
        write_candidate(shown.folder, place, 0, 1, np.full(3, place + 0.5))
    predicted = stored.candidate(shown, JOINT, [third, first], 1)
    assert [each.tolist() for each in predicted] == [[2.5] * 3, [0.5] * 3]
    assert stored.candidate(shown, JOINT, [first, second], 1) is None
    assert stored.candidate(shown, JOINT, [first], 2) is None


@pytest.mark.parametrize("reads", ["samples", "stored_samples", "require_samples", "outlines"])
def test_a_file_without_samples_is_named_and_the_others_can_be_read(stored, reads):
    shown, (first, second, _) = stored.model("m3"), stored.payload_of
    gone = prediction_file(shown.folder, 1, 0)
    gone.unlink()
    gone.with_name(gone.name.replace("prediction", "outline")).unlink()
    read = getattr(stored, reads)
    read(shown, JOINT, [first])
    with pytest.raises(Problem, match=f"no samples of {second}; fit the model again") as missing:
        read(shown, JOINT, [first, second])
    assert missing.value.status == 404
