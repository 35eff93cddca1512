"""Long work: progress and cancel."""

from typing import Annotated

from fastapi import APIRouter, Path, Query, Request, Response
from pydantic import BaseModel, Field

from api.service import access, jobs
from api.service.openapi import problems
from api.service.problems import not_found
from identify.results.document import Json

router = APIRouter(tags=["jobs"])

JobId = Annotated[str, Path(pattern="^[0-9a-f]{16}$")]


class JobView(BaseModel):
    """A job as it is now."""

    id: str = Field(examples=["5f1c7a90b2d34e68"])
    kind: str = Field(description="identify, diagnose, improve, plan, demo, …", examples=["identify"])
    experiment: str | None = Field(examples=["rx130l-joint3"])
    user: str = Field(examples=["ada"])
    state: jobs.JobState = Field(examples=[jobs.JobState.RUNNING])
    fraction: float = Field(description="0 to 1", examples=[0.4])
    words: str = Field(
        description="what it is doing, or why it failed", examples=["session-01.csv: filtering"]
    )
    created: float = Field(description="s since 1970", examples=[1795360000.0])
    ended: float | None = Field(description="s since 1970", examples=[None])
    result: Json = Field(description="what came of it", examples=[{"model": "m2"}])

    @classmethod
    def of(cls, job: jobs.Job) -> "JobView":
        """The view of a snapshot."""
        return cls.model_validate(job, from_attributes=True)

    @classmethod
    def accepted(cls, job: jobs.Job, response: Response) -> "JobView":
        """The view of a job that was just begun; the response says where to ask for it."""
        response.headers["Location"] = f"/jobs/{job.id}"
        return cls.of(job)


@router.get("/jobs")
def list_jobs(
    request: Request,
    _user: access.Viewer,
    experiment: Annotated[str | None, Query(max_length=64)] = None,
    limit: Annotated[int, Query(ge=1, le=1000)] = 100,
) -> list[JobView]:
    """The newest jobs first."""
    return [
        JobView.of(job) for job in access.service_of(request).jobs.jobs(experiment=experiment, limit=limit)
    ]


@router.get("/jobs/{job}")
def get_job(request: Request, _user: access.Viewer, job: JobId) -> JobView:
    """One job. Its progress is also sent over WebSocket at `/jobs/{job}/live`."""
    known = access.service_of(request).jobs.get(job)
    if known is None:
        raise not_found("job", job)
    return JobView.of(known)


@router.post("/jobs/{job}/cancel", status_code=202, responses=problems(409))
def cancel_job(request: Request, _user: access.Operator, job: JobId) -> JobView:
    """Cancel a job: it stops at its next step, or is ended after two seconds. What was stored before
    stays.
    """
    return JobView.of(access.service_of(request).jobs.cancel(job))
