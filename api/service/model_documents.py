"""Model versions as documents: each, all of an experiment, two beside each other."""

from typing import Annotated, Literal

from pydantic import BaseModel, ConfigDict, Field

from api.service.job_documents import JobView
from identify.results.diagnosis import DiagnosisDocument
from identify.results.identification import IdentificationDocument
from identify.results.reading import of_any_version

Identified = Annotated[IdentificationDocument, of_any_version(IdentificationDocument)]
Diagnosed = Annotated[DiagnosisDocument, of_any_version(DiagnosisDocument)]

Cause = Literal["fit", "effect added", "effect removed", "improved"]


class Fit(BaseModel):
    """One least-squares fit of a version."""

    model_config = ConfigDict(frozen=True)

    id: str = Field(examples=["f1"])
    data: str = Field(
        description="fingerprint of the experiment's data that were fitted", examples=["9f2c41d0"]
    )
    sessions: int = Field(description="identification and validation sessions at that time", examples=[3])
    created: str = Field(examples=["2026-11-22T15:04:05+00:00"])
    relative_error: float | None = Field(examples=[0.0733])
    relative_error_validation: float | None = Field(examples=[0.081])


class ModelVersion(BaseModel):
    """A model of the experiment: a named start and the effects added to it."""

    model_config = ConfigDict(frozen=True)

    id: str = Field(examples=["m2"])
    model: str = Field(examples=["usual"])
    add: list[str] = Field(examples=[["load-friction-asymmetric@j3"]])
    cause: Cause = Field(examples=["effect added"])
    change: str | None = Field(
        description="the effect added or removed", examples=["load-friction-asymmetric@j3"]
    )
    parent: str | None = Field(description="the version it was made from", examples=["m1"])
    user: str = Field(examples=["ada"])
    created: str = Field(examples=["2026-11-22T15:04:05+00:00"])
    fits: list[Fit]

    @property
    def fit(self) -> Fit:
        """The newest fit."""
        return self.fits[-1]


class StoryView(BaseModel):
    """All model versions, and which of them is current."""

    versions: list[ModelVersion]
    line: list[str] = Field(description="the versions that lead to the current one", examples=[["m1", "m2"]])
    undone: list[str] = Field(description="what can be redone, last undone last", examples=[["m3"]])
    current: str | None = Field(examples=["m2"])


class VersionView(BaseModel):
    """One model version with its newest fit."""

    version: ModelVersion
    identification: Identified
    diagnosis: Diagnosed | None


class Stepped(BaseModel):
    """The current version after undo or redo, and the job that fits it anew if sessions came since."""

    version: ModelVersion
    job: JobView | None


class Comparison(BaseModel):
    """Two versions side by side."""

    first: Identified
    second: Identified
    added: list[str] = Field(
        description="effects that only the second has", examples=[["load-friction-asymmetric@j3"]]
    )
    removed: list[str] = Field(description="effects that only the first has", examples=[[]])
    relative_error_change: float | None = Field(description="second less first", examples=[-0.0249])


class ResultsView(IdentificationDocument):
    """What the identifier says now: the document of `coulomb identify --json` and where it comes from."""

    version: ModelVersion
    stale: bool = Field(
        description="sessions or settings changed since; a new fit is on its way", examples=[False]
    )
    job: JobView | None = Field(description="the computation under way")
    diagnosis: DiagnosisDocument | None = Field(description="what this version misses, if somebody asked")


class Pending(BaseModel):
    """There are no results yet; this job makes the first."""

    job: JobView
