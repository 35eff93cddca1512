"""What a model is used for, on the pages: motion predicted beside the torque, and files for other programs with certificates."""

from typing import Annotated, Literal

from fastapi import APIRouter, File, Form, Query, Request, UploadFile
from fastapi.responses import HTMLResponse, Response

from api.pages.form_input import input_errors_as_problems, typed_horizons
from api.pages.job_views import follow
from api.pages.layout import experiment_link
from api.pages.rendering import PREFIX
from api.service import access
from api.service.model_use import Driven, Ending
from api.service.problems import Problem
from identify.recording.controller_file import ControllerFile
from identify.recording.strict_yaml import LARGEST_FILE
from identify.results.simulation import HORIZONS
from identify.simulation.controller import decode_controllers

router = APIRouter(prefix=f"{PREFIX}/experiments/{{experiment}}/use", include_in_schema=False)

Version = Annotated[str, Query(max_length=12)]


@router.post("/simulation")
def simulate(
    request: Request,
    user: access.Operator,
    experiment: str,
    version: Version,
    driven_by: Annotated[Driven | Literal["file"], Form()] = "torque",
    horizons: Annotated[str, Form(max_length=200)] = "",
    gains: Annotated[UploadFile | None, File()] = None,
) -> HTMLResponse:
    """Run a version forward along its record."""
    if driven_by != "file" and gains is not None and gains.filename:
        raise Problem(422, f"Choose “gains from a file”, or take the file {gains.filename} away.")
    driver = _gains(gains) if driven_by == "file" else driven_by
    ahead = typed_horizons(horizons) if horizons.strip() else HORIZONS
    job = access.service_of(request).model_use.simulate(experiment, user.name, version, driver, ahead)
    return _followed(request, experiment, job.id)


def _gains(file: UploadFile | None) -> ControllerFile:
    """The gains of a controller's file. Raises the problem 422: there is none, or it is wrong."""
    if file is None or not file.filename:
        raise Problem(422, "Choose the file with the controller's gains, or another way to drive the model.")
    with input_errors_as_problems():
        return decode_controllers(file.file.read(LARGEST_FILE), file.filename)


@router.post("/exports/{ending}")
def export(
    request: Request, user: access.Operator, experiment: str, ending: Ending, version: Version
) -> HTMLResponse:
    """Write a version for another program."""
    job = access.service_of(request).model_use.export(experiment, user.name, version, ending)
    return _followed(request, experiment, job.id)


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
    return _followed(request, experiment, job)


def _followed(request: Request, experiment: str, identifier: str) -> HTMLResponse:
    job = access.service_of(request).jobs.get(identifier)
    simulates = job is not None and job.kind == "simulate"
    failure = "The motion was not predicted" if simulates else "The file was not made"
    return follow(request, identifier, experiment_link(experiment, "use/progress"), failure)
