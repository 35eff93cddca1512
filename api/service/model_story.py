"""The models of one experiment: versions, which one stands, undo and redo; stored in the experiment's folder.

    models/story.json               the versions and which of them is current
    models/m2/f1/identification.json, prediction-0-0.npy …     one fit of version m2
    models/m2/f1/shown/             what figures of that fit show, made again where it is missing
    models/m2/f1/diagnosis.json     what that fit was found to miss; with-0-0-1.npy … what it would predict with one effect more
    models/m2/f1/next-0.json        the experiment that tells rival effects of a joint apart

A version is a list of effects. It is fitted anew whenever sessions were added; every fit is kept. What was said of a fit
is not said of the next one: more sessions may show more.
"""

import fcntl
import hashlib
import os
import threading
from collections.abc import Callable, Generator
from contextlib import contextmanager
from datetime import UTC, datetime
from functools import wraps
from pathlib import Path
from typing import Any, Concatenate, Literal, ParamSpec, TypeVar

from pydantic import BaseModel, ConfigDict, Field, ValidationError

from api.service.model_documents import Cause, Fit, ModelVersion
from api.service.problems import Problem, not_found
from identify.recording.atomic_file import write_atomically
from identify.recording.errors import InputError
from identify.recording.first_fault import first_fault
from identify.results.diagnosis import DiagnosisDocument
from identify.results.identification import IdentificationDocument
from identify.results.next_experiment import NextExperimentDocument
from identify.results.reading import Kind, read_document

IDENTIFICATION_FILE = "identification.json"
DIAGNOSIS_FILE = "diagnosis.json"
"""in the folder of a fit"""


class Story(BaseModel):
    """All versions, the line that leads to the current one, and what was undone (last undone last)."""

    model_config = ConfigDict(frozen=True)

    format: Literal[1] = 1
    versions: list[ModelVersion] = []
    line: list[str] = Field(default=[], examples=[["m1", "m2"]])
    undone: list[str] = Field(default=[], examples=[["m3"]])

    @property
    def current(self) -> ModelVersion | None:
        """The current version, or None before the first fit."""
        return self.version(self.line[-1]) if self.line else None

    @property
    def shown(self) -> list[str]:
        """Ids of the versions that the error is shown of: those that lead to the current one, then those undone."""
        return [*self.line, *reversed(self.undone)]

    def stale(self, data: str) -> list[ModelVersion]:
        """Shown versions, the newest first, whose newest fit is not of the data with the fingerprint `data`."""
        versions = [self.version(each) for each in reversed(self.shown)]
        return [each for each in versions if each.fit.data != data]

    def version(self, identifier: str) -> ModelVersion:
        """The version with that id. Raises the problem 404."""
        for version in self.versions:
            if version.id == identifier:
                return version
        raise not_found("model of this experiment", identifier)

    def required(self, identifier: str | None = None) -> ModelVersion:
        """The version with that id, the current one where none is named. Raises the problem 404, and 409 before the first fit."""
        version = self.version(identifier) if identifier else self.current
        if version is None:
            raise Problem(409, "There is no model yet: measure or import a session, or fit a model first.")
        return version

    def to_undo_to(self) -> str:
        """The version that undo goes back to. Raises the problem 409 if there is none."""
        if len(self.line) < 2:
            raise Problem(409, "There is nothing to undo: this is the first model.")
        return self.line[-2]

    def to_redo(self) -> str:
        """The version that redo brings back. Raises the problem 409 if there is none."""
        if not self.undone:
            raise Problem(409, "There is nothing to redo.")
        return self.undone[-1]


def data_fingerprint(folder: Path) -> str:
    """A text that changes when the experiment file or a session's file does."""
    digest = hashlib.sha256((folder / "experiment.yaml").read_bytes())
    for file in sorted(
        path for path in folder.iterdir() if path.suffix.lower() in (".csv", ".gz", ".h5", ".hdf5")
    ):
        status = file.stat()
        digest.update(f"{file.name} {status.st_size} {status.st_mtime_ns}\n".encode())
    return digest.hexdigest()[:16]


_threads = threading.RLock()
_held: set[Path] = set()
"""folders that this process holds the lock of"""

Parameters = ParamSpec("Parameters")
Result = TypeVar("Result")


def _alone(
    method: Callable[Concatenate["ModelStory", Parameters], Result],
) -> Callable[Concatenate["ModelStory", Parameters], Result]:
    """A method that reads the story and writes what it made of it, while nobody else does."""

    @wraps(method)
    def alone(self: "ModelStory", *args: Parameters.args, **kwargs: Parameters.kwargs) -> Result:
        with self.alone():
            return method(self, *args, **kwargs)

    return alone


class ModelStory:
    """Reads and changes the story of one experiment folder; changes are atomic.

    Whoever changes it is alone with it (`alone`), be it another thread of the service or another process, such as a
    `coulomb run` beside the service. Which models are computed at the same time is the caller's business: the service
    runs one job of an experiment at a time.
    """

    def __init__(self, experiment_folder: Path) -> None:
        self.folder = experiment_folder / "models"
        self._file = self.folder / "story.json"

    def read(self) -> Story:
        """What is stored; an empty story before the first fit. Raises InputError if the file was damaged."""
        try:
            return Story.model_validate_json(self._file.read_bytes())
        except FileNotFoundError:
            return Story()
        except ValidationError as error:
            raise InputError(f"{self._file}: {first_fault(error)}") from error

    @contextmanager
    def alone(self) -> Generator[None]:
        """Hold the story: other threads and other processes wait. May be asked for again by who holds it."""
        with _threads:
            if self.folder in _held:
                yield
                return
            self.folder.mkdir(parents=True, exist_ok=True)
            descriptor = os.open(self.folder, os.O_RDONLY)
            try:
                fcntl.flock(descriptor, fcntl.LOCK_EX)
                _held.add(self.folder)
                yield
            finally:
                _held.discard(self.folder)
                os.close(descriptor)

    def new_fit_folder(self, version: str, fit: str) -> Path:
        """Where a fit's files go; the computation makes it."""
        return self.folder / version / fit

    def next_fit_id(self, identifier: str) -> str:
        """The id of a further fit of a version, or of the first one; never that of a fit in the story."""
        story = self.read()
        known = [each for each in story.versions if each.id == identifier]
        return f"f{1 + max((int(fit.id[1:]) for each in known for fit in each.fits), default=0)}"

    def next_version_id(self) -> str:
        """Never given before, also not to a version that was undone."""
        return f"m{1 + max((int(each.id[1:]) for each in self.read().versions), default=0)}"

    @_alone
    def add_version(
        self,
        *,
        model: str,
        add: list[str],
        cause: Cause,
        change: str | None,
        user: str,
        fit: Fit,
        parent: str | None = None,
        identifier: str | None = None,
    ) -> ModelVersion:
        """Append a version to the line; what was undone before can no longer be redone.

        identifier : that of the folder in which its fit was stored; the next one where left out
        """
        story = self.read()
        version = ModelVersion(
            id=identifier or self.next_version_id(),
            model=model,
            add=add,
            cause=cause,
            change=change,
            parent=parent if parent is not None else (story.line[-1] if story.line else None),
            user=user,
            created=now_text(),
            fits=[fit],
        )
        self._write(story, versions=[*story.versions, version], line=[*story.line, version.id], undone=[])
        return version

    @_alone
    def add_fit(self, identifier: str, fit: Fit) -> ModelVersion:
        """Append a fit to a version."""
        story = self.read()
        version = story.version(identifier)
        version = version.model_copy(update={"fits": [*version.fits, fit]})
        versions = [version if each.id == identifier else each for each in story.versions]
        self._write(story, versions=versions)
        return version

    @_alone
    def same_data(self, before: str, after: str) -> None:
        """Fits of the data with the fingerprint `before` are of those with `after` too: what changed concerns no fit."""
        story = self.read()
        versions = [
            each.model_copy(
                update={
                    "fits": [
                        fit.model_copy(update={"data": after}) if fit.data == before else fit
                        for fit in each.fits
                    ]
                }
            )
            for each in story.versions
        ]
        self._write(story, versions=versions)

    @_alone
    def undo(self) -> ModelVersion:
        """Go back to the version before. Raises the problem 409 if there is none."""
        story = self.read()
        before = story.to_undo_to()
        self._write(story, line=story.line[:-1], undone=[*story.undone, story.line[-1]])
        return story.version(before)

    @_alone
    def redo(self) -> ModelVersion:
        """Take back the last undo. Raises the problem 409 if there is none."""
        story = self.read()
        undone = story.to_redo()
        self._write(story, line=[*story.line, undone], undone=story.undone[:-1])
        return story.version(undone)

    def identification(self, identifier: str) -> IdentificationDocument:
        """What the version's newest fit found. Raises the problem 404 if its file was removed, InputError if it was damaged."""
        file = self.fit_folder(identifier) / IDENTIFICATION_FILE
        try:
            return read_document(IdentificationDocument, file)
        except FileNotFoundError as error:
            gone = f"{file.relative_to(self.folder.parent)} of model {identifier} is gone; put it back from a backup."
            raise Problem(404, f"The file {gone}") from error

    def fit_folder(self, identifier: str) -> Path:
        """The folder of the version's newest fit."""
        return self.folder / identifier / self.read().version(identifier).fit.id

    def diagnosis(self, identifier: str) -> DiagnosisDocument | None:
        """What the version's newest fit was found to miss, or None if nobody asked yet."""
        return _read_if_there(DiagnosisDocument, self.fit_folder(identifier) / DIAGNOSIS_FILE)

    def diagnosed(self, identifier: str) -> int | None:
        """When the version's newest fit was diagnosed, ns of the file; None if it was not: tells one diagnosis from another."""
        try:
            return (self.fit_folder(identifier) / DIAGNOSIS_FILE).stat().st_mtime_ns
        except FileNotFoundError:
            return None

    def newest_diagnosis(self, identifier: str) -> tuple[Fit, DiagnosisDocument] | None:
        """The newest fit of the version that was diagnosed, and what it was found to miss; None if nobody ever asked."""
        for fit in reversed(self.read().version(identifier).fits):
            file = self.folder / identifier / fit.id / DIAGNOSIS_FILE
            document = _read_if_there(DiagnosisDocument, file)
            if document is not None:
                return fit, document
        return None

    def store_diagnosis(self, identifier: str, document: DiagnosisDocument) -> None:
        """Keep a diagnosis with the version's newest fit, instead of an older one."""
        folder = self.fit_folder(identifier)
        for old in folder.glob("next-*.json"):
            old.unlink()
        write_atomically(folder / DIAGNOSIS_FILE, document.json_text(indent=1).encode())

    def next_experiment(self, identifier: str, joint: int) -> NextExperimentDocument | None:
        """The experiment that tells the rivals of a joint (counted from 0) apart, or None if nobody asked yet."""
        return _read_if_there(NextExperimentDocument, self.fit_folder(identifier) / f"next-{joint}.json")

    def store_next_experiment(self, identifier: str, joint: int, document: NextExperimentDocument) -> None:
        """Keep it with the version's newest fit."""
        write_atomically(
            self.fit_folder(identifier) / f"next-{joint}.json", document.json_text(indent=1).encode()
        )

    def _write(self, story: Story, **changes: Any) -> None:
        self.folder.mkdir(parents=True, exist_ok=True)
        changed = story.model_copy(update=changes)
        write_atomically(self._file, changed.model_dump_json(indent=1).encode())


def _read_if_there(kind: type[Kind], file: Path) -> Kind | None:
    try:
        return read_document(kind, file)
    except FileNotFoundError:
        return None


def now_text() -> str:
    """The present time as the stored files spell it."""
    return datetime.now(UTC).isoformat(timespec="seconds")
