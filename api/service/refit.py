"""The current model, fitted anew over all sessions so far: what happens by itself after every session, in the service
and in `coulomb run`, into one story of the experiment's models.
"""

import re
import shutil
import tempfile
from collections.abc import Generator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

from api.service.model_documents import Fit, ModelVersion
from api.service.model_story import ModelStory, now_text

if TYPE_CHECKING:  # the service does not load what its processes compute with
    from api.service.computations import FitFound

FIRST_MODEL = "usual"
"""What is fitted by itself after the first session: the model that the diagnosis starts from."""


@dataclass(frozen=True)
class Refit:
    """What is to be fitted, and which place in the story it takes."""

    version: str
    fit: str
    model: str
    add: list[str]


def next_refit(story: ModelStory) -> Refit:
    """A further fit of the version that stands, or the first one."""
    current = story.read().current
    if current is None:
        return Refit("m1", "f1", FIRST_MODEL, [])
    return Refit(current.id, story.next_fit_id(current.id), current.model, current.add)


def fresh_folder(story: ModelStory, version: str, fit: str) -> Path:
    """Make the folder for a fit's files; what a cancelled computation left there is removed.

    It is another fit's folder where somebody else stored one of that id meanwhile: a fit has the id of its folder.
    """
    with story.alone():
        known = [each.id for entry in story.read().versions if entry.id == version for each in entry.fits]
        folder = story.new_fit_folder(version, story.next_fit_id(version) if fit in known else fit)
        shutil.rmtree(folder, ignore_errors=True)
        folder.mkdir(parents=True)
    return folder


@contextmanager
def folder_apart(story: ModelStory, version: str) -> Generator[Path]:
    """Where a process beside the service computes a fit of a version; it gets its place and id when it is stored."""
    story.folder.mkdir(parents=True, exist_ok=True)
    scratch = Path(tempfile.mkdtemp(prefix="apart-", dir=story.folder))
    try:
        yield scratch / version / "fit"
    finally:
        shutil.rmtree(scratch, ignore_errors=True)


def store_refit(story: ModelStory, fitted: "FitFound", user: str) -> ModelVersion:
    """Note what `computations.fit` found for `next_refit`, as a further fit of its version or as the first.

    A fit that was computed apart is moved to a place that nobody else computes into.
    """
    with story.alone():
        folder = fitted.folder
        if folder.parent.parent != story.folder:
            folder = _moved_into_place(story, folder)
        version, fit = folder.parent.name, fit_entry(folder.name, fitted)
        if any(each.id == version for each in story.read().versions):
            return story.add_fit(version, fit)
        return story.add_version(
            model=FIRST_MODEL, add=[], cause="fit", change=None, user=user, fit=fit, identifier=version
        )


def _moved_into_place(story: ModelStory, folder: Path) -> Path:
    """Move a fit that was computed apart to its version, as the newest of all that are there or are computed there.

    The first fit of a story makes a version that nobody computes meanwhile.
    """
    version = story.folder / folder.parent.name
    if not story.read().versions:
        version = story.folder / f"m{1 + max(_numbers(story.folder, 'm'), default=0)}"
    version.mkdir(exist_ok=True)
    place = version / f"f{1 + max(_numbers(version, 'f'), default=0)}"
    folder.rename(place)
    return place


def _numbers(folder: Path, letter: str) -> list[int]:
    """Of the folders in a folder that are called by that letter and a number."""
    return [int(each.name[1:]) for each in folder.iterdir() if re.fullmatch(rf"{letter}\d+", each.name)]


def fit_entry(identifier: str, fitted: "FitFound") -> Fit:
    """The story's entry of what `computations.fit` found."""
    document = fitted.identification
    return Fit(
        id=identifier,
        data=fitted.data,
        sessions=len(document.sessions),
        created=now_text(),
        relative_error=document.relative_error,
        relative_error_validation=document.relative_error_validation,
    )
