"""What a model is used for: how it predicts motion, and files for simulators, controllers and drives."""

from typing import Annotated

from fastapi import APIRouter, Query, Request, Response

from api.service import access
from api.service.access import service_of
from api.service.model_use import Driven, Ending
from api.service.openapi import ResourceRoute, problems
from api.service.problems import Problem
from api.service.routes.experiments import ExperimentId
from api.service.routes.jobs import JobView
from api.service.routes.models import ModelId
from identify.results.certificate import Certificate
from identify.results.simulation import SimulationDocument

router = APIRouter(tags=["use of models"], route_class=ResourceRoute)


@router.post("/experiments/{experiment}/models/{model}/simulation", status_code=202, responses=problems(409))
def simulate(
    request: Request,
    response: Response,
    user: access.Operator,
    experiment: ExperimentId,
    model: ModelId,
    driven_by: Annotated[
        Driven,
        Query(
            description="the recorded torque, or its controllers: with the gains that the drives held when the sessions were "
            "recorded, or told from the record"
        ),
    ] = "torque",
) -> JobView:
    """Run the model forward along its record, in windows of a tenth of a second and of a second."""
    job = service_of(request).model_use.simulate(experiment, user.name, model, driven_by)
    return JobView.accepted(job, response)


@router.get("/experiments/{experiment}/models/{model}/simulation")
def get_simulation(
    request: Request, _user: access.Viewer, experiment: ExperimentId, model: ModelId
) -> SimulationDocument:
    """How well the model predicts motion: the document of `coulomb simulate --json`."""
    document = service_of(request).model_use.simulation(experiment, model)
    if document is None:
        raise Problem(404, f"The model {model} was not simulated yet: POST to this address.")
    return document


@router.post(
    "/experiments/{experiment}/models/{model}/exports/{ending}", status_code=202, responses=problems(409)
)
def export(
    request: Request,
    response: Response,
    user: access.Operator,
    experiment: ExperimentId,
    model: ModelId,
    ending: Ending,
) -> JobView:
    """Write the model for another program: URDF, SDF, MJCF (xml), Python, C, structured text, FMU or data."""
    job = service_of(request).model_use.export(experiment, user.name, model, ending)
    return JobView.accepted(job, response)


@router.get("/experiments/{experiment}/models/{model}/exports/{ending}")
def get_certificate(
    request: Request, _user: access.Viewer, experiment: ExperimentId, model: ModelId, ending: Ending
) -> Certificate:
    """What the exported file keeps, approximates and loses of the model, and its error on the record."""
    return service_of(request).model_use.certificate(experiment, model, ending)


@router.get(
    "/experiments/{experiment}/models/{model}/exports/{ending}/file",
    response_class=Response,
    responses={
        200: {
            "description": "The file; of C a ZIP archive of source, header and certificate.",
            "content": {
                "application/octet-stream": {
                    "schema": {"type": "string", "format": "binary"},
                    "example": "(the file)",
                }
            },
        }
    },
)
def get_file(
    request: Request, _user: access.Viewer, experiment: ExperimentId, model: ModelId, ending: Ending
) -> Response:
    """The exported file."""
    name, content = service_of(request).model_use.exported(experiment, model, ending)
    return Response(
        content,
        media_type="application/octet-stream",
        headers={"Content-Disposition": f'attachment; filename="{name}"'},
    )
