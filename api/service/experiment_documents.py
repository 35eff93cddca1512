"""Experiments as documents: listed, with their sessions, just imported."""

from pydantic import BaseModel, ConfigDict, Field

from api.service.job_documents import JobView
from api.service.session_documents import SessionSummary
from identify.recording.experiment_file import Payload


class ExperimentSummary(BaseModel):
    """One stored experiment."""

    model_config = ConfigDict(from_attributes=True)

    id: str = Field(examples=["rx130l-joint3"])
    name: str = Field(examples=["rx130l-joint3"])
    joints: list[str] = Field(examples=[["j3"]])
    modified: float = Field(description="s since 1970", examples=[1795360000.0])
    problem: str | None = Field(description="what is wrong with its experiment.yaml", examples=[None])


class ExperimentView(ExperimentSummary):
    """One stored experiment with its payloads and sessions."""

    payloads: list[Payload] = Field(examples=[[{"name": "none", "mass": 0.0}]])
    sessions: list[SessionSummary]


class Imported(BaseModel):
    """What an upload became, and the identification that was started by itself."""

    experiment: ExperimentView
    job: JobView
    passed_over: list[str] = Field(
        default=[],
        description="files of the archive that experiment.yaml does not name and that were not stored",
        examples=[["README.md"]],
    )


class ImportedRecords(BaseModel):
    """The experiment that was made, what was decided on the way, and the identification that was started."""

    experiment: ExperimentView
    decided: list[str] = Field(examples=[["Lage [Grad]: deg -> rad (× 0.0174532925) by its name"]])
    job: JobView
