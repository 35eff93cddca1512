"""Payload sessions as documents: measured, being prepared, and their recordings."""

from enum import StrEnum
from typing import Annotated, Literal, Self

from pydantic import BaseModel, ConfigDict, Field, model_validator

from api.service import text_forms
from api.service.job_documents import JobView
from api.service.request_document import RequestDocument
from api.service.session_payload import SessionPayload

Metre = Annotated[float, Field(ge=-100, le=100, allow_inf_nan=False)]
InertiaMoment = Annotated[float, Field(ge=-1e6, le=1e6, allow_inf_nan=False)]


class TypedPayload(RequestDocument):
    """A payload in the last link's frame: its name alone if the rig knows it, else what it weighs and
    where.
    """

    name: Annotated[str, Field(pattern=text_forms.NAME, examples=["disk-3.5"])]
    mass: Annotated[float | None, Field(ge=0, le=1e5, allow_inf_nan=False, examples=[3.4584])] = None
    com: Annotated[tuple[Metre, Metre, Metre] | None, Field(examples=[[1.277, 0.0, 0.0]])] = None
    inertia: Annotated[
        tuple[InertiaMoment, InertiaMoment, InertiaMoment, InertiaMoment, InertiaMoment, InertiaMoment]
        | None,
        Field(
            description="about the centre of mass: XX XY XZ YY YZ ZZ, kg m²", examples=[[0, 0, 0, 0, 0, 0]]
        ),
    ] = None

    @model_validator(mode="after")
    def _whole(self) -> Self:
        if self.mass is None and (self.com is not None or self.inertia is not None):
            raise ValueError("mass: is missing; a payload of one's own needs it")
        return self


class SessionSummary(BaseModel):
    """A payload session, measured or being prepared."""

    id: str = Field(examples=["session-01"])
    file: str | None = Field(description="null until it is measured", examples=["session-01.h5"])
    payload: SessionPayload = Field(
        description="kg, m, kg m²; mass null where the file does not say it",
        examples=[{"name": "disk", "mass": 3.4584, "com": [1.277, 0.0, 0.0]}],
    )
    weighed: float | None = Field(
        description="kg, the payload as weighed; null where it was not weighed here", examples=[3.4602]
    )
    role: Literal["identification", "validation"] = Field(examples=["identification"])
    state: str = Field(
        description="new, checked, payload confirmed, armed, running; done, aborted, faulted; "
        "measured (elsewhere), missing, damaged",
        examples=["complete"],
    )
    reason: str | None = Field(description="why it ended so, in words", examples=[None])
    rig: str | None = Field(examples=["rx130l-joint3-simulated"])
    plan: str | None = Field(examples=["joint3-sinusoids"])
    started: str | None = Field(
        description="ISO 8601, UTC; null where the file does not say", examples=["2026-11-22T15:04:05+00:00"]
    )
    operator: str | None = Field(description="who measured it", examples=["ada"])
    seconds: float | None = Field(
        description="from the first sample to the last; null where not known", examples=[60.0]
    )
    lost: float | None = Field(
        description="share of the drives' answers that did not come, 0 to 1", examples=[0.0002]
    )
    excluded: str | None = Field(
        description="why no model uses it; null where it takes part in its role", examples=[None]
    )
    note: str = Field(description="what somebody wrote about it", examples=["second try, colder"])


class CheckItemView(BaseModel):
    """One thing that was looked at before a session."""

    model_config = ConfigDict(from_attributes=True)

    what: str = Field(examples=["node 3"])
    ok: bool = Field(examples=[True])
    words: str = Field(examples=["answers, homed"])
    advice: bool = Field(
        description="something to do about it, although the session may go on", examples=[False]
    )


class RigCheckView(BaseModel):
    """What the check of the rig found, in words."""

    model_config = ConfigDict(from_attributes=True)

    ok: bool = Field(examples=[True])
    items: list[CheckItemView]


class ChangedSession(BaseModel):
    """A session after a change, and the job that fits the models again where the data have changed."""

    session: SessionSummary
    job: JobView | None


class RecordingFormat(StrEnum):
    """In what form a recording is downloaded."""

    ORIGINAL = "original"
    HDF5 = "hdf5"
    CSV = "csv"
    RAW = "raw"
    MAT = "mat"
    PARQUET = "parquet"
    HDF5_SI = "hdf5-si"


class RecordingSummary(BaseModel):
    """The recording of a measured session."""

    session: str = Field(examples=["session-00"])
    file: str = Field(examples=["session-00.h5"])
    bytes: int = Field(examples=[1843200])
    formats: list[RecordingFormat] = Field(examples=[["original", "csv", "mat", "parquet", "hdf5-si"]])
