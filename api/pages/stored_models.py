"""The stored models of one experiment as the pages show them: versions, their JSON and their samples."""

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from api.pages.joint_samples import JointSamples
from api.pages.kept import Kept
from api.service.experiment_store import ExperimentStore
from api.service.model_story import ModelStory, ModelVersion, Story
from api.service.prediction_files import COLUMNS, read_prediction
from api.service.problems import Problem

_samples: Kept[JointSamples] = Kept(12)


@dataclass(frozen=True)
class ShownModel:
    """One version: its place in the story from 1, its stored form, and the JSON of its newest fit."""

    number: int
    version: ModelVersion
    document: dict[str, Any]
    folder: Path

    @property
    def words(self) -> str:
        """What the version is called in a list: the model's name, or the effect that made it."""
        change = self.version.change
        if change is None:
            return self.version.model
        sign = "−" if self.version.cause == "effect removed" else "+"
        return f"{sign} {change}"

    def joint(self, name: str) -> dict[str, Any]:
        """The joint's part of the JSON."""
        return next(entry for entry in self.document["joints"] if entry["joint"] == name)


class StoredExperiment:
    """One experiment of the store with its models; everything is read when it is asked for."""

    def __init__(self, store: ExperimentStore, identifier: str) -> None:
        self.id = identifier
        self.folder = store.folder(identifier)
        self.declared = store.declared(identifier)
        self.models = ModelStory(self.folder)
        self.story: Story = self.models.read()

    @property
    def name(self) -> str:
        return self.declared.name

    @property
    def joint_names(self) -> list[str]:
        return [joint.name for joint in self.declared.robot.joints]

    @property
    def payload_of(self) -> dict[str, str]:
        """Session file -> name of its payload, in the file's order."""
        return {entry.file: entry.payload for entry in self.declared.sessions}

    def model(self, identifier: str) -> ShownModel:
        """A version by id. Raises the problem 404."""
        version = self.story.version(identifier)
        number = [each.id for each in self.story.versions].index(identifier) + 1
        return ShownModel(
            number, version, self.models.identification(identifier), self.models.fit_folder(identifier)
        )

    def current(self) -> ShownModel | None:
        """The version that stands, or None before the first fit."""
        return self.model(self.story.line[-1]) if self.story.line else None

    def joint_or_first(self, joint: str | None) -> str:
        """The joint asked for, or the first. Raises the problem 404 for one that the robot does not have."""
        if joint is None:
            return self.joint_names[0]
        if joint not in self.joint_names:
            raise Problem(404, f"The robot has no joint {joint}; it has {', '.join(self.joint_names)}.")
        return joint

    def fitted_files(self, model: ShownModel) -> list[str]:
        """Session files that the model's newest fit has seen, in the experiment's order."""
        known = {entry["file"] for entry in model.document["sessions"]}
        return [file for file in self.payload_of if file in known] or list(self.payload_of)

    def samples(self, model: ShownModel, joint: str, files: Sequence[str]) -> JointSamples:
        """The samples of one joint over `files`, in that order. Raises the problem 404 if a file has none."""
        places = list(self.payload_of)
        sessions = tuple(places.index(file) for file in files)
        key = (model.folder, tuple(files), self.joint_names.index(joint))
        return _samples.get(key, lambda: _gathered(model.folder, tuple(files), sessions, key[2]))


def _gathered(folder: Path, files: tuple[str, ...], sessions: tuple[int, ...], joint: int) -> JointSamples:
    parts = []
    for file, session in zip(files, sessions, strict=True):
        stored = read_prediction(folder, session, joint)
        if stored is None:
            raise Problem(404, f"The fit has no samples of {file}; fit the model again.")
        parts.append(stored)
    columns = {name: np.concatenate([part[name] for part in parts]) for name in COLUMNS}
    columns["moving"] = columns["moving"] > 0
    lengths = [len(part["time"]) for part in parts]
    return JointSamples(files=files, session=np.repeat(np.arange(len(files)), lengths), **columns)
