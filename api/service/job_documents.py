"""Jobs as documents: where one is, and what came of it."""

from enum import StrEnum

from pydantic import (
    BaseModel,
    ConfigDict,
    Field,
    SerializerFunctionWrapHandler,
    field_validator,
    model_serializer,
)

from identify.recording.errors import InputError
from identify.results.improvement import ImprovementDocument
from identify.results.reading import document_of


class JobState(StrEnum):
    """Where a job is; the last four are final."""

    QUEUED = "queued"
    RUNNING = "running"
    DONE = "done"
    FAILED = "failed"
    CANCELLED = "cancelled"
    LOST = "lost"

    @property
    def final(self) -> bool:
        """True if nothing more will happen."""
        return self not in (JobState.QUEUED, JobState.RUNNING)


class JobResult(BaseModel):
    """What came of a job: by what names it can be asked for. In JSON stands only what there is."""

    model_config = ConfigDict(frozen=True)

    experiment: str | None = Field(default=None, description="a new experiment", examples=["demo"])
    model: str | None = Field(
        default=None, description="the model version that was made, or that it is about", examples=["m2"]
    )
    diagnosis: str | None = Field(default=None, description="the model version diagnosed", examples=["m2"])
    joint: str | None = Field(default=None, description="the joint it is about", examples=["j3"])
    improvement: ImprovementDocument | None = Field(default=None, description="step by step")
    plan: str | None = Field(default=None, description="a new plan", examples=["joint3-sinusoids"])
    proof: str | None = Field(default=None, description="a new proof on the drive", examples=["00"])
    rig: str | None = Field(
        default=None,
        description="the rig whose drives' tables were chosen",
        examples=["rx130l-joint3-simulated"],
    )
    format: str | None = Field(
        default=None,
        description="the format that a model is exported to, also while it is not there yet or could not be made",
        examples=["urdf"],
    )
    file: str | None = Field(default=None, description="the file written", examples=["rx130l-joint3-m2.urdf"])

    @field_validator("improvement", mode="before")
    @classmethod
    def _of_any_version(cls, values: object) -> object:
        """A stored result may be older than this version; what cannot be read any more is left out."""
        if values is None or isinstance(values, ImprovementDocument):
            return values
        try:
            return document_of(ImprovementDocument, values, "result of a job")
        except InputError:
            return None

    @model_serializer(mode="wrap")
    def _what_there_is(self, dumped: SerializerFunctionWrapHandler):
        return {name: value for name, value in dumped(self).items() if value is not None}


class JobView(BaseModel):
    """A job as it is now."""

    model_config = ConfigDict(from_attributes=True)

    id: str = Field(examples=["5f1c7a90b2d34e68"])
    kind: str = Field(description="identify, diagnose, improve, plan, demo, …", examples=["identify"])
    experiment: str | None = Field(examples=["rx130l-joint3"])
    user: str = Field(examples=["ada"])
    state: JobState = Field(examples=[JobState.RUNNING])
    fraction: float = Field(description="0 to 1", examples=[0.4])
    words: str = Field(
        description="what it is doing, or why it failed", examples=["session-01.csv: filtering"]
    )
    created: float = Field(description="s since 1970", examples=[1795360000.0])
    ended: float | None = Field(description="s since 1970", examples=[None])
    result: JobResult = Field(description="what came of it", examples=[{"model": "m2"}])
