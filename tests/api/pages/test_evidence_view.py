"""The evidence of an effect after the data have changed: what was found before is said to be."""

import shutil
from pathlib import Path
from types import SimpleNamespace
from typing import cast

import pytest

from api.pages.evidence_view import SelectedEvidence, selected_evidence
from api.pages.stored_models import StoredExperiment
from api.service.experiment_store import ExperimentStore
from api.service.model_story import ModelStory
from identify.recording.experiment_file import read_experiment_file

JOINT = "j3"
EFFECT = "load-friction-asymmetric"


@pytest.fixture
def folder(stored_laboratory: Path, tmp_path: Path) -> Path:
    """One of its own to change."""
    return shutil.copytree(stored_laboratory / "experiments" / "rx130l-joint3", tmp_path / "experiment")


def evidence(folder: Path, effect: str = EFFECT) -> SelectedEvidence:
    """Of the effect that made the current version, or of another, as the page shows it."""
    store = SimpleNamespace(
        folder=lambda _: folder, declared=lambda _: read_experiment_file(folder / "experiment.yaml")
    )
    stored = StoredExperiment(cast(ExperimentStore, store), "experiment")
    found = selected_evidence(stored, stored.require_current(), None, JOINT, effect)
    assert found is not None
    return found


def fit_again(folder: Path, version: str) -> None:
    """A further fit of a version, to two sessions, as after an exclusion."""
    story = ModelStory(folder)
    shutil.copytree(story.fit_folder(version), story.new_fit_folder(version, "f2"))
    (story.new_fit_folder(version, "f2") / "diagnosis.json").unlink()
    fit = story.read().version(version).fit
    story.add_fit(version, fit.model_copy(update={"id": "f2", "data": "changed", "sessions": 2}))


def test_what_a_diagnosis_of_the_data_before_found_is_said_to_be_of_them(folder: Path) -> None:
    same = evidence(folder)
    assert same.other_data is None
    assert same.errors.change is not None

    # the current version is fitted to the changed data first; the one before it still stands on the old ones
    fit_again(folder, "m2")
    changed = evidence(folder)
    assert changed.other_data is not None
    assert "3 sessions then, 2 now" in changed.other_data
    assert changed.errors.relative_error_before is None
    assert changed.errors.heldout_error_after == same.errors.heldout_error_after

    # once both are, the errors of the fit can be compared again, those on unseen motion only with themselves
    fit_again(folder, "m1")
    again = evidence(folder)
    assert again.errors.change == pytest.approx(same.errors.change)
    assert again.other_data == changed.other_data
    assert again.errors.heldout_change == same.errors.heldout_change


def test_an_effect_of_the_first_model_is_never_said_to_be_left_out(folder: Path) -> None:
    """There is no model without it to compare with: the effect that was added last is shown."""
    assert evidence(folder, "coulomb").effect == EFFECT


def test_an_effect_that_was_added_before_has_the_evidence_of_its_own_step(folder: Path) -> None:
    then = evidence(folder)
    ModelStory(folder).redo()
    assert evidence(folder, "load-stribeck").effect == "load-stribeck"
    now = evidence(folder)
    assert (now.effect, now.errors, now.with_words) == (EFFECT, then.errors, "with it")
