"""What stands on "what is missing", from the stored diagnosis."""

import shutil
from pathlib import Path
from types import SimpleNamespace
from typing import cast

from api.pages.missing_body import body_context
from api.pages.stored_models import StoredExperiment
from api.service.experiment_store import ExperimentStore
from api.service.model_story import ModelStory
from identify.recording.experiment_file import read_experiment_file


def test_what_one_missing_effect_leaves_is_what_the_next_begins_with(
    stored_laboratory: Path, tmp_path: Path
) -> None:
    folder = shutil.copytree(stored_laboratory / "experiments" / "rx130l-joint3", tmp_path / "experiment")
    story = ModelStory(folder)
    diagnosis = story.diagnosis("m2")
    assert diagnosis is not None
    (joint,) = diagnosis.joints
    # each beside the model with those before it, and what is left with all of them
    beside = [
        each.changed(heldout_error_before=before, heldout_error_after=0.01)
        for each, before in zip(joint.candidates, (0.05, 0.03, 0.02), strict=True)
    ]
    story.store_diagnosis("m2", diagnosis.changed(joints=(joint.changed(evidence=tuple(beside)),)))
    store = SimpleNamespace(
        folder=lambda _: folder, declared=lambda _: read_experiment_file(folder / "experiment.yaml")
    )
    stored = StoredExperiment(cast(ExperimentStore, store), "experiment")
    steps = body_context(stored, stored.require_current(), "j3")["missing_steps"]
    assert [step.candidate.heldout_error_before for step in steps] == [0.05, 0.03, 0.02]
    assert [step.after for step in steps] == [0.03, 0.02, 0.01]
