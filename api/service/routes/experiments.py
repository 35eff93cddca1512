"""Experiments: folders with a robot, payloads and sessions."""

from typing import Annotated, Literal, cast

from fastapi import APIRouter, File, Form, Path, Request, Response, UploadFile
from pydantic import Field

from api.service import access, text_forms
from api.service.experiment_documents import ExperimentSummary, ExperimentView, Imported
from api.service.job_documents import JobView
from api.service.openapi import ResourceRoute, problems
from api.service.request_document import RequestDocument
from api.service.routes.jobs import accepted
from api.service.session_catalogue import CatalogueEntry
from api.service.session_documents import SessionSummary
from identify.recording import Payload
from identify.recording.plain_text import Printable

router = APIRouter(tags=["experiments"], route_class=ResourceRoute)

ExperimentId = Annotated[str, Path(pattern=text_forms.SMALL_ID)]
SessionId = Annotated[str, Path(pattern=text_forms.SESSION_ID)]


class NewExperiment(RequestDocument):
    """An experiment to be created on a rig; robot, gains and known payloads come from the rig's file."""

    name: Annotated[
        Printable,
        Field(min_length=1, max_length=100, pattern=text_forms.WITHOUT_SLASHES, examples=["rx130l-joint3"]),
    ]
    rig: Annotated[str, Field(pattern=text_forms.NAME, examples=["rx130l-joint3-simulated"])]


def session_summary(entry: CatalogueEntry) -> SessionSummary:
    """An entry of the catalogue as a document."""
    row, facts = entry.row, entry.facts
    return SessionSummary(
        id=row.id,
        file=row.file,
        payload=row.payload,
        weighed=row.weighed,
        role=cast(Literal["identification", "validation"], row.role),
        state=row.state,
        reason=row.reason,
        rig=entry.rig,
        plan=entry.plan,
        started=facts.started,
        operator=facts.operator,
        seconds=facts.seconds,
        lost=facts.lost,
        excluded=entry.excluded,
        note=entry.note,
    )


def view(request: Request, identifier: str) -> ExperimentView:
    """The whole of one experiment. Raises the problem 404."""
    service = access.service_of(request)
    row = service.experiments.row(identifier)
    sessions = [session_summary(each) for each in service.catalogue.entries(identifier)]
    return ExperimentView(
        **ExperimentSummary.model_validate(row).model_dump(), payloads=row.payloads, sessions=sessions
    )


@router.get("/experiments")
def list_experiments(request: Request, _user: access.Viewer) -> list[ExperimentSummary]:
    """All experiments, the one changed last first."""
    return [ExperimentSummary.model_validate(row) for row in access.service_of(request).experiments.rows()]


@router.post("/experiments", status_code=201)
def create_experiment(
    request: Request, response: Response, _user: access.Operator, new: NewExperiment
) -> ExperimentView:
    """Create an experiment without sessions for a rig."""
    service = access.service_of(request)
    row = service.experiments.create(service.rigs.experiment_file(new.rig, new.name))
    response.headers["Location"] = f"/experiments/{row.id}"
    return view(request, row.id)


@router.post("/experiments/demo", status_code=202, responses=problems(507))
def start_demo(request: Request, response: Response, user: access.Operator) -> JobView:
    """Measure three payload sessions on the simulated arm and fit the first model: nothing real moves.

    The job's result names the new experiment and its model. Nothing is listed before it is done. Who has a demo under way
    is given that one.
    """
    return accepted(access.service_of(request).demos.start(user.name), response)


@router.get("/experiments/{experiment}")
def get_experiment(request: Request, _user: access.Viewer, experiment: ExperimentId) -> ExperimentView:
    """One experiment with its payloads and sessions."""
    return view(request, experiment)


@router.post("/experiments/import", status_code=201, responses=problems(507))
def import_experiment(
    request: Request,
    response: Response,
    user: access.Operator,
    file: Annotated[
        UploadFile, File(description="a .zip of experiment.yaml and its session files, in any folder")
    ],
) -> Imported:
    """Store an experiment that was measured elsewhere; it is identified at once."""
    service = access.service_of(request)
    service.jobs.refuse_more(user.name)
    service.disk.require_room()
    added = service.uploads.add_experiment(file.file)
    job = service.models.refit(added.row.id, user.name)
    response.headers["Location"] = f"/experiments/{added.row.id}"
    return Imported(
        experiment=view(request, added.row.id), job=JobView.model_validate(job), passed_over=added.passed_over
    )


@router.post("/experiments/{experiment}/sessions/import", status_code=201, responses=problems(409, 507))
def import_measured_session(
    request: Request,
    user: access.Operator,
    experiment: ExperimentId,
    file: Annotated[UploadFile, File(description="one session: .csv, .csv.gz or .h5")],
    payload: Annotated[
        Printable, Form(min_length=1, max_length=100, description="name of a payload of the experiment")
    ],
    role: Annotated[Literal["identification", "validation"], Form()] = "identification",
    mass: Annotated[
        float | None, Form(ge=0, le=1e6, allow_inf_nan=False, description="kg, of a new payload")
    ] = None,
) -> Imported:
    """Add a session that was measured elsewhere; all sessions are identified anew."""
    service = access.service_of(request)
    known = Payload(name=payload, mass=mass) if mass is not None else None
    service.jobs.refuse_more(user.name)
    service.disk.require_room()
    service.uploads.add_session(experiment, file.file, file.filename or "", payload, role, known)
    job = service.models.refit(experiment, user.name)
    return Imported(experiment=view(request, experiment), job=JobView.model_validate(job))
