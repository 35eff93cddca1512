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


def test_several_missing_effects_stand_beside_each_other_and_the_verdict_begins_at_the_model(
    stored_laboratory: Path, tmp_path: Path
) -> None:
    folder = shutil.copytree(stored_laboratory / "experiments" / "rx130l-joint3", tmp_path / "experiment")
    story = ModelStory(folder)
    diagnosis = story.diagnosis("m2")
    assert diagnosis is not None
    (joint,) = diagnosis.joints
    alone = [each.changed(heldout_error_before=0.07) for each in joint.candidates]
    # each beside the model with the two others, and what is left with all of them
    beside = [
        each.changed(heldout_error_before=before, heldout_error_after=0.01)
        for each, before in zip(joint.candidates, (0.05, 0.03, 0.02), strict=True)
    ]
    changed = joint.changed(verdict="missing", candidates=tuple(alone), evidence=tuple(beside))
    story.store_diagnosis("m2", diagnosis.changed(joints=(changed,)))
    store = SimpleNamespace(
        folder=lambda _: folder, declared=lambda _: read_experiment_file(folder / "experiment.yaml")
    )
    stored = StoredExperiment(cast(ExperimentStore, store), "experiment")
    context = body_context(stored, stored.require_current(), "j3")
    shown = [each.candidate for each in context["missing_effects"]]
    assert [each.heldout_error_before for each in shown] == [0.05, 0.03, 0.02]
    assert {each.heldout_error_after for each in shown} == {0.01}
    assert context["verdict"].detail.endswith("falls from 7.00\u202f% to 1.00\u202f%.")
