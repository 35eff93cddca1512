"""The drives' own compensation tables from a model: shown first, then written and read back where an operator says so."""

from typing import Annotated

from fastapi import APIRouter, Path, Query, Request, Response
from pydantic import Field

from api.service import access, text_forms
from api.service.access import client_address, service_of
from api.service.drive_table_documents import TablesWriting
from api.service.job_documents import JobView
from api.service.openapi import ResourceRoute, problems
from api.service.problems import Problem
from api.service.request_document import RequestDocument
from api.service.routes.experiments import ExperimentId
from api.service.routes.jobs import accepted
from identify.results.drive_tables import DriveTablesDocument

router = APIRouter(tags=["drive tables"], route_class=ResourceRoute)

WritingNumber = Annotated[str, Path(pattern=text_forms.NUMBER)]


class TablesOfModel(RequestDocument):
    """Which model's tables, for which rig."""

    rig: Annotated[str, Field(pattern=text_forms.NAME, examples=["rx130l-joint3-simulated"])]
    model: Annotated[
        str | None,
        Field(
            pattern=text_forms.MODEL_NUMBER,
            description="a version; null for the current one",
            examples=["m2"],
        ),
    ] = None


@router.post("/experiments/{experiment}/drive-tables", status_code=202, responses=problems(409))
def compute_drive_tables(
    request: Request,
    response: Response,
    user: access.Operator,
    experiment: ExperimentId,
    wanted: TablesOfModel,
) -> JobView:
    """Choose the tables of a rig's drives for the least error on the record (a job); nothing is written to the drives."""
    job = service_of(request).drive_tables.compute(experiment, user, wanted.rig, wanted.model)
    return accepted(job, response)


@router.get("/experiments/{experiment}/drive-tables")
def get_drive_tables(
    request: Request,
    _user: access.Viewer,
    experiment: ExperimentId,
    rig: Annotated[str, Query(max_length=64, examples=["rx130l-joint3-simulated"])],
    model: Annotated[
        str | None, Query(max_length=12, description="a version; left out, the current one", examples=["m2"])
    ] = None,
) -> DriveTablesDocument:
    """What the drives are to hold: the document of `coulomb drive-tables --json`."""
    tables = service_of(request).drive_tables.tables(experiment, rig, model)
    if tables is None:
        raise Problem(404, f"The tables for rig {rig} were not computed yet: POST to this address.")
    return tables


@router.post("/experiments/{experiment}/drive-tables/writings", status_code=201, responses=problems(409, 503))
def write_drive_tables(
    request: Request,
    response: Response,
    user: access.Operator,
    experiment: ExperimentId,
    wanted: TablesOfModel,
) -> TablesWriting:
    """Write the tables that were computed to the drives, and read them back. Nothing moves; a drive that has power, moves or
    has a fault refuses, and if one refuses all hold what they held before. Whoever does it has the rig from then on."""
    service = service_of(request)
    writing = service.drive_tables.write(experiment, user, wanted.rig, wanted.model, client_address(request))
    service.live.tell(wanted.rig)
    response.headers["Location"] = f"/experiments/{experiment}/drive-tables/writings"
    return writing


@router.get("/experiments/{experiment}/drive-tables/writings")
def list_writings(request: Request, _user: access.Viewer, experiment: ExperimentId) -> list[TablesWriting]:
    """Everything that was written to drives from this experiment, the newest first, with what they held before."""
    return service_of(request).drive_tables.writings(experiment)


@router.post(
    "/experiments/{experiment}/drive-tables/writings/{writing}/back",
    status_code=201,
    responses=problems(409, 503),
)
def write_back(
    request: Request,
    response: Response,
    user: access.Operator,
    experiment: ExperimentId,
    writing: WritingNumber,
) -> TablesWriting:
    """Write what the drives held before a writing, and read it back."""
    service = service_of(request)
    taken_back = service.drive_tables.write_back(experiment, user, writing, client_address(request))
    service.live.tell(taken_back.rig)
    response.headers["Location"] = f"/experiments/{experiment}/drive-tables/writings"
    return taken_back
