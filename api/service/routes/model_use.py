"""What a model is used for: how it predicts motion, and files for simulators, controllers and drives."""

from typing import Annotated

import numpy as np
from fastapi import APIRouter, Body, Query, Request, Response
from numpy.typing import NDArray
from pydantic import Field

from api.service import access
from api.service.access import service_of
from api.service.free_run_documents import Curves, FreeRunView
from api.service.job_documents import JobView
from api.service.model_use import MOST_HORIZONS, Driven, Ending
from api.service.openapi import ResourceRoute, problems
from api.service.problems import Problem
from api.service.routes.experiments import ExperimentId
from api.service.routes.jobs import accepted
from api.service.routes.models import ModelId
from identify.recording.controller_file import ControllerFile
from identify.results.certificate import Certificate
from identify.results.simulation import HORIZONS, SimulationDocument

router = APIRouter(tags=["use of models"], route_class=ResourceRoute)

Horizon = Annotated[float, Field(gt=0.0, allow_inf_nan=False)]

_GAINS = {"joints": [{"joint": "j3", "reference": "qref1", "position": 5000.0, "velocity": 60.0}]}


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
            "recorded, or told from the record; `known` takes the former where the record holds them, else the torque"
        ),
    ] = "torque",
    horizon: Annotated[
        list[Horizon] | None,
        Query(
            max_length=MOST_HORIZONS,
            description="s: length of the windows that begin at measured states; may be repeated; 0.1 and 1 where there is none",
            examples=[[0.1, 1.0]],
        ),
    ] = None,
    gains: Annotated[ControllerFile | None, Body(examples=[_GAINS])] = None,
) -> JobView:
    """Run the model forward along its record: in windows of each horizon, and freely from the start.

    In closed loop with gains where the body holds them (those of a controller's file, `docs/simulation.md`), else as `driven_by`
    says.
    """
    if gains is not None and driven_by != "torque":
        raise Problem(
            422, f"driven_by is {driven_by} and the body holds gains: one of them says what drives the model."
        )
    job = service_of(request).model_use.simulate(
        experiment, user.name, model, gains or driven_by, horizon or HORIZONS
    )
    return accepted(job, response)


@router.get("/experiments/{experiment}/models/{model}/simulation")
def get_simulation(
    request: Request, _user: access.Viewer, experiment: ExperimentId, model: ModelId
) -> SimulationDocument:
    """How well the model predicts motion: the document of `coulomb simulate --json`."""
    document = service_of(request).model_use.simulation(experiment, model)
    if document is None:
        raise Problem(404, f"The model {model} was not simulated yet: POST to this address.")
    return document


@router.get("/experiments/{experiment}/models/{model}/simulation/free-run")
def get_free_run(
    request: Request,
    _user: access.Viewer,
    experiment: ExperimentId,
    model: ModelId,
    session: Annotated[
        str, Query(max_length=255, description="the session's file", examples=["session-00.csv"])
    ],
    joint: Annotated[str, Query(max_length=64, description="the joint's name", examples=["j3"])],
) -> FreeRunView:
    """Measured and simulated motion over time, from the start of a session: of the model and of the usual one."""
    service = service_of(request)
    joints = [each.name for each in service.experiments.declared(experiment).robot.joints]
    if joint not in joints:
        raise Problem(404, f"The robot has no joint {joint}; it has {', '.join(joints)}.")
    curves = service.model_use.free_run(experiment, model, session, joints.index(joint))
    if curves is None:
        raise Problem(
            404, f"The model {model} was not simulated on a session {session}: POST to …/simulation."
        )
    position, speed = (
        Curves(**{name: _numbers(values) for name, values in vars(signals).items()})
        for signals in (curves.position, curves.speed)
    )
    return FreeRunView(
        session=session, joint=joint, time=_numbers(curves.time), position=position, speed=speed
    )


def _numbers(values: NDArray[np.float64]) -> list[float | None]:
    return [float(value) if np.isfinite(value) else None for value in values]


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
    return accepted(job, response)


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
