"""Long work: progress and cancel."""

from typing import Annotated

from fastapi import APIRouter, Path, Query, Request, Response

from api.service import access, text_forms
from api.service.job_documents import JobView
from api.service.jobs import Job
from api.service.openapi import problems
from api.service.problems import not_found

router = APIRouter(tags=["jobs"])

JobId = Annotated[str, Path(pattern=text_forms.TOKEN)]


def accepted(job: Job, response: Response) -> JobView:
    """The view of a job that was just begun; the response says where to ask for it."""
    response.headers["Location"] = f"/jobs/{job.id}"
    return JobView.model_validate(job)


@router.get("/jobs")
def list_jobs(
    request: Request,
    _user: access.Viewer,
    experiment: Annotated[str | None, Query(max_length=64)] = None,
    limit: Annotated[int, Query(ge=1, le=1000)] = 100,
) -> list[JobView]:
    """The newest jobs first."""
    return [
        JobView.model_validate(job)
        for job in access.service_of(request).jobs.jobs(experiment=experiment, limit=limit)
    ]


@router.get("/jobs/{job}")
def get_job(request: Request, _user: access.Viewer, job: JobId) -> JobView:
    """One job. Its progress is also sent over WebSocket at `/jobs/{job}/live`."""
    known = access.service_of(request).jobs.get(job)
    if known is None:
        raise not_found("job", job)
    return JobView.model_validate(known)


@router.post("/jobs/{job}/cancel", status_code=202, responses=problems(409))
def cancel_job(request: Request, _user: access.Operator, job: JobId) -> JobView:
    """Cancel a job: it stops at its next step, or is ended after two seconds. What was stored before
    stays.
    """
    return JobView.model_validate(access.service_of(request).jobs.cancel(job))
