"""The stored models of one experiment as the pages show them: versions, their documents and their samples."""

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Protocol

import numpy as np

from api.pages.joint_samples import JointSamples, every_few, gathered
from api.pages.lru_cache import LruCache
from api.service.model_documents import ModelVersion
from api.service.model_story import ModelStory, Story
from api.service.prediction_files import prediction_file, read_candidate, read_outline, read_prediction
from api.service.problems import Problem
from api.service.stored_samples import StoredSamples
from identify.recording.experiment_file import ExperimentFile
from identify.results.identification import IdentificationDocument, JointError

_samples: LruCache[JointSamples] = LruCache(4_000_000, lambda samples: len(samples.time))
"""80 bytes a sample; those that are in the fit may be copied once more"""


@dataclass(frozen=True)
class ShownModel:
    """One version: its place in the story from 1, its stored form, and what its newest fit found."""

    number: int
    version: ModelVersion
    document: IdentificationDocument
    folder: Path

    @property
    def words(self) -> str:
        """What the version is called in a list: the model's name, or the effect that made it."""
        change = self.version.change
        if change is None:
            return self.version.model
        sign = "−" if self.version.cause == "effect removed" else "+"
        return f"{sign} {change}"

    def joint(self, name: str) -> JointError:
        """The joint's errors."""
        return next(entry for entry in self.document.joints if entry.joint == name)

    def samples_of(self, name: str) -> int:
        """How many of the fit's rows are the joint's."""
        each = (entry for speed in self.document.speeds if speed.range == "all" for entry in speed.joints)
        counted = next((entry.samples for entry in each if entry.joint == name), None)
        return self.document.samples // len(self.document.joints) if counted is None else counted


class Experiments(Protocol):
    """Where experiments are kept, such as the service's store."""

    def folder(self, identifier: str) -> Path:
        """The folder of an experiment. Raises the problem 404."""
        ...

    def declared(self, identifier: str) -> ExperimentFile:
        """Its checked file. Raises the problem 404, and InputError if the file is broken."""
        ...


class StoredExperiment:
    """One experiment of the store with its models; everything is read when it is asked for."""

    def __init__(self, store: Experiments, identifier: str) -> None:
        self.id = identifier
        self.folder = store.folder(identifier)
        self.declared = store.declared(identifier)
        self.models = ModelStory(self.folder)
        self.story: Story = self.models.read()

    @property
    def name(self) -> str:
        """Name by which the experiment is shown."""
        return self.declared.name

    @property
    def joint_names(self) -> list[str]:
        """(n,) from base to tip"""
        return [joint.name for joint in self.declared.robot.joints]

    @property
    def payload_of(self) -> dict[str, str]:
        """Session file -> name of its payload, in the file's order."""
        return {entry.file: entry.payload for entry in self.declared.sessions}

    @property
    def identification_files(self) -> set[str]:
        """Files of the sessions that fits use; others only check them, or are excluded."""
        return {
            entry.file
            for entry in self.declared.sessions
            if entry.role == "identification" and entry.excluded is None
        }

    def model(self, identifier: str) -> ShownModel:
        """A version by id. Raises the problem 404."""
        version = self.story.version(identifier)
        number = [each.id for each in self.story.versions].index(identifier) + 1
        return ShownModel(
            number, version, self.models.identification(identifier), self.models.fit_folder(identifier)
        )

    def current(self) -> ShownModel | None:
        """The current version, or None before the first fit."""
        return self.model(self.story.line[-1]) if self.story.line else None

    def require_current(self) -> ShownModel:
        """The current version. Raises the problem 409 before the first fit."""
        shown = self.current()
        if shown is None:
            raise Problem(409, "There is no model yet: measure or import a session first.")
        return shown

    def joint_or_first(self, joint: str | None) -> str:
        """The joint asked for, or the first. Raises the problem 404 for one that the robot does not have."""
        if joint is None:
            return self.joint_names[0]
        if joint not in self.joint_names:
            raise Problem(404, f"The robot has no joint {joint}; it has {', '.join(self.joint_names)}.")
        return joint

    def files_of_fit(self, model: ShownModel) -> set[str]:
        """Session files that the model's newest fit was made of; it was only checked on the others."""
        return {entry.file for entry in model.document.sessions if entry.role == "identification"}

    def fitted_files(self, model: ShownModel) -> list[str]:
        """Session files that the model's newest fit has seen, in the experiment's order."""
        known = {entry.file for entry in model.document.sessions}
        return [file for file in self.payload_of if file in known] or list(self.payload_of)

    def samples(self, model: ShownModel, joint: str, files: Sequence[str]) -> JointSamples:
        """The samples of one joint over `files`, in that order. Raises the problem 404 if a file has none."""
        number = self.joint_names.index(joint)
        key = (model.folder, tuple(files), number)

        def whole() -> JointSamples:
            parts = self._stored(model, files, number)
            return gathered(parts, [slice(0, part.count) for part in parts.values()])

        return _samples.get(key, whole)

    def figure_samples(self, model: ShownModel, joint: str, files: Sequence[str]) -> JointSamples:
        """As many of `samples` as figures show; no others are copied."""
        parts = self.stored_samples(model, joint, files)
        return gathered(parts, every_few([part.count for part in parts.values()]))

    def candidate(
        self, model: ShownModel, joint: str, files: Sequence[str], rank: int
    ) -> list[np.ndarray] | None:
        """The torque of each file as the diagnosis predicts it with the candidate of that rank; None if it was not kept."""
        number, places = self.joint_names.index(joint), list(self.payload_of)
        parts = [read_candidate(model.folder, places.index(file), number, rank) for file in files]
        return None if any(part is None for part in parts) else [part for part in parts if part is not None]

    def stored_samples(self, model: ShownModel, joint: str, files: Sequence[str]) -> dict[str, StoredSamples]:
        """The mapped samples behind `samples`, by file; read only as far as they are used."""
        return self._stored(model, files, self.joint_names.index(joint))

    def require_samples(self, model: ShownModel, joint: str, files: Sequence[str]) -> None:
        """Raises the problem 404 if a file has no samples; none is read."""
        places, number = list(self.payload_of), self.joint_names.index(joint)
        for file in files:
            if not prediction_file(model.folder, places.index(file), number).is_file():
                raise _no_samples(file)

    def outlines(self, model: ShownModel, joint: str, files: Sequence[str]) -> dict[str, np.ndarray]:
        """The outline of each of `stored_samples`: file -> (11, blocks). Raises the problem 404 if a file has none."""
        places, number = list(self.payload_of), self.joint_names.index(joint)
        outlines = {file: read_outline(model.folder, places.index(file), number) for file in files}
        for file, table in outlines.items():
            if table is None:
                raise _no_samples(file)
        return {file: table for file, table in outlines.items() if table is not None}

    def _stored(self, model: ShownModel, files: Sequence[str], joint: int) -> dict[str, StoredSamples]:
        places = list(self.payload_of)
        parts: dict[str, StoredSamples] = {}
        for file in files:
            stored = read_prediction(model.folder, places.index(file), joint)
            if stored is None:
                raise _no_samples(file)
            parts[file] = stored
        return parts


def _no_samples(file: str) -> Problem:
    return Problem(404, f"The fit has no samples of {file}; fit the model again.")
