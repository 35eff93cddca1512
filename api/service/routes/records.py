"""Other people's records: looked at, and made an experiment of."""

from collections.abc import Sequence
from typing import Annotated, Literal

from fastapi import APIRouter, File, Form, Request, Response, UploadFile
from pydantic import Json

from api.service import access
from api.service.experiment_documents import ImportedRecords
from api.service.experiment_upload import uploaded
from api.service.job_documents import JobView
from api.service.openapi import ResourceRoute, problems
from api.service.record_documents import CanLogImport, Dialect, RecordDescription, RecordImport
from api.service.request_body import FORM_OF_RECORDS, MOST_RECORDS
from api.service.routes.experiments import view

router = APIRouter(tags=["experiments"], route_class=ResourceRoute, form_limits=FORM_OF_RECORDS)

Records = Annotated[
    list[UploadFile],
    File(
        description="CSV of any dialect, plain or gzip, MAT, Parquet, MDF, MCAP",
        min_length=1,
        max_length=MOST_RECORDS,
    ),
]


CanLogs = Annotated[
    list[UploadFile],
    File(
        description="candump, Vector, PEAK, Kvaser and others, plain or gzip",
        min_length=1,
        max_length=MOST_RECORDS,
    ),
]


@router.post("/experiments/import/columns")
def describe_records(
    request: Request,
    _user: access.Operator,
    files: Records,
    header_line: Annotated[
        int | None, Form(ge=0, le=100_000, description="from 1; 0: none; told by the cells if left out")
    ] = None,
    separator: Annotated[
        str | None, Form(max_length=10, description="a sign, or comma, semicolon, tab, space")
    ] = None,
    decimal: Annotated[Literal[".", ","] | None, Form()] = None,
) -> list[RecordDescription]:
    """What records hold, and what their columns probably are; nothing is kept."""
    uploads = access.service_of(request).uploads
    dialect = Dialect(header_line=header_line, separator=separator, decimal=decimal)
    return uploads.describe_records([uploaded(file) for file in files], dialect)


@router.post("/experiments/import/records", status_code=201, responses=problems(404, 409, 507))
def import_records(
    request: Request,
    response: Response,
    user: access.Operator,
    files: Records,
    settings: Annotated[Json[RecordImport], Form(description="JSON of a RecordImport")],
    robot: Annotated[UploadFile | None, File(description="URDF, SDF or MJCF of the robot")] = None,
) -> ImportedRecords:
    """Make an experiment of records, or add them to one; it is identified at once."""
    service = access.service_of(request)
    service.jobs.refuse_more(user.name)
    service.disk.require_room()
    row, decided = service.uploads.add_records(
        [uploaded(file) for file in files], uploaded(robot) if robot and robot.filename else None, settings
    )
    return _imported(request, response, row.id, decided, user.name)


@router.post("/experiments/import/can-logs", status_code=201, responses=problems(404, 409, 507))
def import_can_logs(
    request: Request,
    response: Response,
    user: access.Operator,
    files: CanLogs,
    settings: Annotated[Json[CanLogImport], Form(description="JSON of a CanLogImport")],
) -> ImportedRecords:
    """Make an experiment of logs of a CAN bus by a rig's mapping; it is identified at once."""
    service = access.service_of(request)
    service.jobs.refuse_more(user.name)
    service.disk.require_room()
    row, decided = service.uploads.add_can_logs(
        [uploaded(file) for file in files], service.rigs.file(settings.rig), settings
    )
    return _imported(request, response, row.id, decided, user.name)


def _imported(
    request: Request, response: Response, experiment: str, decided: Sequence[str], user: str
) -> ImportedRecords:
    job = access.service_of(request).models.refit(experiment, user)
    response.headers["Location"] = f"/experiments/{experiment}"
    return ImportedRecords(
        experiment=view(request, experiment), decided=list(decided), job=JobView.model_validate(job)
    )
