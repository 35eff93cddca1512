"""The identified model as a URDF: one choice of standard parameters of real bodies that has the identified base parameters.

It is computed when it is asked for, as a job, and kept beside the fit that it belongs to. It needs the extra `feasible`.
"""

from typing import Annotated

from fastapi import APIRouter, Query, Request
from fastapi.responses import HTMLResponse

from api.pages.job_views import follow
from api.pages.layout import experiment_link
from api.pages.rendering import PREFIX
from api.pages.stored_models import StoredExperiment
from api.service import access
from api.service.job_documents import JobResult

router = APIRouter(prefix=f"{PREFIX}/experiments/{{experiment}}", include_in_schema=False)

TITLE = "Finding bodies that can exist with these parameters"


@router.post("/urdf")
def make(
    request: Request, user: access.Operator, experiment: str, version: Annotated[str, Query(max_length=12)]
) -> HTMLResponse:
    """Make the URDF of a version."""
    service = access.service_of(request)
    stored = StoredExperiment(service.experiments, experiment)
    shown = stored.model(version)
    arguments = {
        "experiment": str(stored.folder),
        "model": shown.version.model,
        "add": shown.version.add,
        "output": str(shown.folder),
    }
    job = service.jobs.submit(
        "identify",
        "api.service.identified_urdf:write_identified_urdf",
        lambda: arguments,
        lambda name: JobResult(file=name),
        user=user.name,
        experiment=experiment,
    )
    return follow(request, job.id, experiment_link(experiment, "urdf/progress"), title=TITLE)


@router.get("/urdf/progress")
def progress(
    request: Request, _user: access.Viewer, experiment: str, job: Annotated[str, Query(max_length=32)]
) -> HTMLResponse:
    """How far it is; then a fresh page with the download."""
    return follow(request, job, experiment_link(experiment, "urdf/progress"), title=TITLE)
