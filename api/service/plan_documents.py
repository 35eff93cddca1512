"""Excitation plans as documents: listed, in closed form, with what was found when they were made."""

from typing import Annotated

from pydantic import BaseModel, ConfigDict, Discriminator, Field, RootModel, Tag

from daq.excitation.excitation_plan import Phase
from daq.excitation.plan_report_document import PlanFindings


class PlanPurpose(BaseModel):
    """What a plan was made to tell apart."""

    model_config = ConfigDict(frozen=True)

    rivals: tuple[str, ...]
    """names of the effects"""
    joint: str
    payload: str
    """the one to mount"""
    separation: float | None
    """standard deviations between them that are expected"""
    decides: bool
    """whether that is enough"""


class SeparatingPlanReport(BaseModel):
    """The report on a plan that was made to tell effects apart."""

    model_config = ConfigDict(frozen=True)

    purpose: PlanPurpose
    remarks: tuple[str, ...] = ()
    """what the rig's limits made of the motion"""


class PredictedCurrent(BaseModel):
    """The current of one joint with one payload, as it was predicted."""

    payload: str
    joint: str
    limit: float
    """A"""
    current: list[float]
    """A, at the times of the prediction"""


class PredictedCurrents(BaseModel):
    """The currents that a plan asks for, as they were predicted."""

    time: list[float]
    """s"""
    currents: list[PredictedCurrent]


class StoredPlanReport(PlanFindings):
    """The document of `coulomb plan --json` without the plan itself, and the predicted currents over time."""

    predicted: PredictedCurrents


def _kind(report: object) -> str:
    """A report on a plan that is to tell effects apart has a purpose."""
    separates = isinstance(report, SeparatingPlanReport) or (isinstance(report, dict) and "purpose" in report)
    return "separating" if separates else "of a model"


Report = Annotated[
    Annotated[StoredPlanReport, Tag("of a model")] | Annotated[SeparatingPlanReport, Tag("separating")],
    Discriminator(_kind),
]


class StoredReport(RootModel[Report]):
    """What is kept of a plan beside it."""


class PlanSummary(BaseModel):
    """One stored plan."""

    id: str = Field(examples=["joint3-sinusoids"])
    name: str = Field(examples=["joint3 sinusoids"])
    rig: str = Field(examples=["rx130l-joint3-simulated"])
    model: str = Field(examples=["load-velocity"])
    joints: list[str] = Field(examples=[["j3"]])
    duration: float = Field(description="s", examples=[60.0])


class PlanView(PlanSummary):
    """One stored plan with its phases in closed form."""

    start: list[float] = Field(description="rad or m", examples=[[0.35]])
    phases: list[Phase] = Field(examples=[[{"kind": "dwell", "duration": 0.5}]])
    report: Report | None = Field(
        description="the document of `coulomb plan --json`: deviations to expect, what the plan cannot tell, and the "
        "predicted currents over time; of a plan that is to tell effects apart, those and the separation to expect; null for a "
        "plan that was not made here",
    )


class PlanPreview(BaseModel):
    """What the joints are going to do; one list per joint."""

    time: list[float] = Field(description="s", examples=[[0.0, 0.1]])
    position: list[list[float]] = Field(description="rad or m", examples=[[[0.35, 0.36]]])
    velocity: list[list[float]] = Field(description="rad/s or m/s", examples=[[[0.0, 0.2]]])
    acceleration: list[list[float]] = Field(description="rad/s² or m/s²", examples=[[[0.0, 1.0]]])
    violations: list[str] = Field(description="limits of the rig that it breaks, in words", examples=[[]])


class MadePlanView(BaseModel):
    """A plan just made for a proposed experiment."""

    plan: str = Field(examples=["load-friction-asymmetric-from-load-friction-on-j3"])
    rig: str = Field(examples=["rx130l-joint3-simulated"])
    payload: str = Field(description="the payload to mount", examples=["disk-7"])
    remarks: list[str] = Field(description="what the rig's limits made of the proposal", examples=[[]])
