"""A model story that was stored before documents had a format."""

import json
import shutil
from pathlib import Path

import pytest

from api.service.model_story import ModelStory
from api.service.problems import Problem
from identify.results.document import FORMAT

STORED = Path(__file__).parents[1] / "identify" / "results" / "stored-format-1"


def test_a_stored_story_is_read_as_it_was(tmp_path):
    shutil.copytree(STORED, tmp_path / "models")
    story = ModelStory(tmp_path)
    assert [version.id for version in story.read().versions] == ["m1", "m2", "m3"]
    assert story.identification("m1").model == "usual"
    assert story.identification("m3").structured is not None
    diagnosis = story.diagnosis("m1")
    assert diagnosis is not None
    assert diagnosis.joints[0].missing == ("load-friction-asymmetric",)
    found = story.next_experiment("m1", 0)
    assert found is not None
    assert found.proposals[0].decides
    nothing = story.next_experiment("m2", 0)
    assert nothing is not None
    assert (nothing.experiment, nothing.rivals, nothing.separation_so_far) == (None, (), None)
    assert story.diagnosis("m3") is None


def test_a_story_that_goes_on_is_stored_in_the_present_format(tmp_path):
    shutil.copytree(STORED, tmp_path / "models")
    story = ModelStory(tmp_path)
    diagnosis = story.diagnosis("m1")
    assert diagnosis is not None
    story.store_diagnosis("m1", diagnosis)
    assert json.loads((tmp_path / "models/m1/f1/diagnosis.json").read_text())["format"] == FORMAT
    assert story.diagnosis("m1") == diagnosis
    assert story.next_experiment("m1", 0) is None  # it belonged to the diagnosis before


def test_a_model_whose_folder_was_removed_is_named_with_its_file(tmp_path):
    shutil.copytree(STORED, tmp_path / "models")
    shutil.rmtree(tmp_path / "models" / "m3")
    with pytest.raises(
        Problem, match=r"identification\.json of model m3 is gone; put it back from a backup"
    ) as gone:
        ModelStory(tmp_path).identification("m3")
    assert gone.value.status == 404
