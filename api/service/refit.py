"""The model that stands, fitted anew over all sessions so far: what happens by itself after every session, in the service
and in `coulomb run`, into one story of the experiment's models.
"""

import shutil
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

from api.service.model_story import Fit, ModelStory, ModelVersion, now_text

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
    return Refit(current.id, f"f{len(current.fits) + 1}", current.model, current.add)


def fresh_folder(story: ModelStory, version: str, fit: str) -> Path:
    """Where a fit's files go; what a cancelled computation left there is removed."""
    folder = story.new_fit_folder(version, fit)
    shutil.rmtree(folder, ignore_errors=True)
    return folder


def store_refit(story: ModelStory, fitted: "FitFound", user: str) -> ModelVersion:
    """Note what `computations.fit` found for `next_refit`, as a further fit of the version that stands or as the first."""
    current = story.read().current
    if current is not None:
        return story.add_fit(current.id, fit_entry(f"f{len(current.fits) + 1}", fitted))
    return story.add_version(
        model=FIRST_MODEL, add=[], cause="fit", change=None, user=user, fit=fit_entry("f1", fitted)
    )


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
