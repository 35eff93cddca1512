"""Proofs on the drive as documents."""

from typing import Annotated, Literal

from pydantic import BaseModel, Field

from api.proof_drive import Drive
from api.service.session_documents import SessionSummary
from identify.results.compensation import CompensationDocument
from identify.results.reading import of_any_version


class UnfinishedRunView(BaseModel):
    """The run of a proof that ended last, where nobody wrote down what came of it, as after a kill."""

    drive: Drive = Field(examples=["with"])
    recording: str = Field(
        description="inside the proof's folder; it is kept", examples=["incomplete/session-01.h5"]
    )
    seconds: float = Field(description="s of samples that it holds", examples=[4.2])
    words: str = Field(description="what happened and what is kept")


class ProofView(BaseModel):
    """One proof, and how far it is."""

    proof: str = Field(description="its number within the experiment", examples=["00"])
    model: str | None = Field(
        description="the version; null for one that was named on the command line", examples=["m2"]
    )
    effects: list[str] = Field(
        description="the model in words: a named one, and what was added", examples=[["usual", "stribeck@j3"]]
    )
    rig: str = Field(examples=["rx130l-joint3-simulated"])
    plan: str = Field(examples=["joint3-sinusoids"])
    payload: str = Field(examples=["disk-3.5"])
    part: Literal["whole", "friction"] = Field(examples=["whole"])
    share: float = Field(examples=[0.6])
    operator: str = Field(examples=["ada"])
    created: str = Field(examples=["2026-11-28T09:00:00+00:00"])
    next: Drive | None = Field(
        description="the drive that comes next; null where both came to their end", examples=["without"]
    )
    unfinished: UnfinishedRunView | None = Field(
        default=None,
        description="the run that ended last, where nobody wrote down what came of it, as after a kill; `next` says what "
        "is to be driven again",
        examples=[None],
    )
    without: SessionSummary | None = Field(description="the drive without feedforward torque")
    with_torque: SessionSummary | None = Field(description="the drive with it")
    result: Annotated[CompensationDocument, of_any_version(CompensationDocument)] | None = Field(
        description="the following errors; null until feedforward torque was sent"
    )
