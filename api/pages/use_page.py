"""What a model is used for, on the pages: motion predicted beside the torque, and files for other programs with certificates."""

from typing import Annotated

from fastapi import APIRouter, Form, Query, Request
from fastapi.responses import HTMLResponse, Response

from api.pages.job_views import follow
from api.pages.layout import experiment_link
from api.pages.rendering import PREFIX
from api.service import access
from api.service.model_use import Driven, Ending

router = APIRouter(prefix=f"{PREFIX}/experiments/{{experiment}}/use", include_in_schema=False)

Version = Annotated[str, Query(max_length=12)]


@router.post("/simulation")
def simulate(
    request: Request,
    user: access.Operator,
    experiment: str,
    version: Version,
    driven_by: Annotated[Driven, Form()] = "torque",
) -> HTMLResponse:
    """Run a version forward along its record."""
    job = access.service_of(request).model_use.simulate(experiment, user.name, version, driven_by)
    return follow(request, job.id, experiment_link(experiment, "use/progress"))


@router.post("/exports/{ending}")
def export(
    request: Request, user: access.Operator, experiment: str, ending: Ending, version: Version
) -> HTMLResponse:
    """Write a version for another program."""
    job = access.service_of(request).model_use.export(experiment, user.name, version, ending)
    return follow(request, job.id, experiment_link(experiment, "use/progress"))


@router.get("/exports/{ending}")
def download(
    request: Request, _user: access.Viewer, experiment: str, ending: Ending, version: Version
) -> Response:
    """The file."""
    name, content = access.service_of(request).model_use.exported(experiment, version, ending)
    return Response(
        content,
        media_type="application/octet-stream",
        headers={"Content-Disposition": f'attachment; filename="{name}"'},
    )


@router.get("/progress")
def progress(
    request: Request, _user: access.Viewer, experiment: str, job: Annotated[str, Query(max_length=32)]
) -> HTMLResponse:
    """How far it is; then a fresh page with what was found."""
    return follow(request, job, experiment_link(experiment, "use/progress"))
