"""A model's friction and cogging in the drives' own tables: chosen, looked at, and written where an operator says so."""

from typing import Annotated
from urllib.parse import urlencode

from fastapi import APIRouter, Form, Query, Request
from fastapi.responses import HTMLResponse, Response

from api.pages.choices import JointChoice, RigChoice, VersionChoice, chosen_model
from api.pages.drive_table_words import joint_tables, writing_row
from api.pages.experiment_frame import experiment_context, no_model_page
from api.pages.form_input import input_errors_as_problems
from api.pages.job_views import follow
from api.pages.layout import experiment_link, frame
from api.pages.rendering import PREFIX, page
from api.pages.rigs_of_experiment import rig_of_choice, rigs_of_experiment
from api.pages.sentence import sentence
from api.pages.stored_models import StoredExperiment
from api.service import access
from api.service.jobs import Job
from api.service.service import Service

router = APIRouter(prefix=f"{PREFIX}/experiments/{{experiment}}/drive-tables", include_in_schema=False)

Rig = Annotated[str, Form(max_length=64)]
Version = Annotated[str, Form(max_length=12)]


@router.get("")
def drive_tables_page(
    request: Request,
    user: access.Viewer,
    experiment: str,
    version: VersionChoice = None,
    rig: RigChoice = None,
    joint: JointChoice = None,
) -> HTMLResponse:
    """The tables of one joint's drive for a model and a rig, and what was written so far."""
    service = access.service_of(request)
    stored = StoredExperiment(service.experiments, experiment)
    context = frame(request, user, "results", experiment)
    shown = chosen_model(stored, version) or stored.current()
    name = stored.joint_or_first(joint)
    if shown is None:
        return no_model_page(request, stored, name, context)
    rigs = rigs_of_experiment(service, stored)
    rig_id = rig_of_choice(service, experiment, rigs, rig)
    kept = {"version": str(shown.number), "rig": rig_id or ""}
    context |= experiment_context(stored, name, shown, "drive-tables", kept)
    with input_errors_as_problems():
        tables = service.drive_tables.tables(experiment, rig_id, shown.version.id) if rig_id else None
        outdated = service.drive_tables.outdated(experiment, rig_id, shown.version.id) if rig_id else ""
        writings = service.drive_tables.writings(experiment)
    here = experiment_link(experiment, "drive-tables")
    rows = [writing_row(experiment, each) for each in writings]
    context |= {
        "shown": shown,
        "versions": [stored.model(each.id) for each in stored.story.versions],
        "rigs": list(rigs),
        "rig_id": rig_id,
        "other_rig": service.catalogue.other_rig(experiment, rig_id) if rig_id else None,
        "tables": tables,
        "fault": service.drive_tables.fault(experiment, rig_id, shown.version.id) if rig_id else None,
        "of_joint": joint_tables(tables, name) if tables is not None else None,
        "why_not": (outdated or _why_not(service, rig_id)) if rig_id else "",
        "rows": rows,
        "last_written": next((each for each in rows if each.rig == rig_id and each.tone == "good"), None),
        "here_link": here,
        "compute_link": f"{here}/compute",
        "write_link": f"{here}/write",
    }
    return page(request, "drive_tables.html", **context)


@router.post("/compute")
def compute(
    request: Request, user: access.Operator, experiment: str, rig: Rig, version: Version
) -> HTMLResponse:
    """Choose the tables; progress until they are there."""
    service = access.service_of(request)
    with input_errors_as_problems():
        shown = chosen_model(StoredExperiment(service.experiments, experiment), version)
        job = service.drive_tables.compute(experiment, user, rig, shown.version.id if shown else None)
    return _progress(request, experiment, job.id)


@router.get("/progress")
def progress(
    request: Request, _user: access.Viewer, experiment: str, job: Annotated[str, Query(max_length=32)]
) -> HTMLResponse:
    """How far it is; then the page with the tables."""
    return _progress(request, experiment, job)


@router.post("/write")
def write(request: Request, user: access.Operator, experiment: str, rig: Rig, version: Version) -> Response:
    """Write what the page shows to the drives, and read it back."""
    service = access.service_of(request)
    with input_errors_as_problems():
        shown = chosen_model(StoredExperiment(service.experiments, experiment), version)
        service.drive_tables.write(
            experiment, user, rig, shown.version.id if shown else None, access.client_address(request)
        )
    service.live.tell(rig)
    return Response(status_code=204, headers={"HX-Refresh": "true"})


@router.post("/writings/{number}/back")
def write_back(request: Request, user: access.Operator, experiment: str, number: str) -> Response:
    """Write what the drives held before a writing."""
    service = access.service_of(request)
    with input_errors_as_problems():
        writing = service.drive_tables.write_back(experiment, user, number, access.client_address(request))
    service.live.tell(writing.rig)
    return Response(status_code=204, headers={"HX-Refresh": "true"})


def _why_not(service: Service, rig: str) -> str:
    return sentence(service.drive_tables.why_not(rig))


def _progress(request: Request, experiment: str, identifier: str) -> HTMLResponse:
    def result_link(job: Job) -> str:
        query = urlencode({"version": job.result.model or "", "rig": job.result.rig or ""})
        return f"{experiment_link(experiment, 'drive-tables')}?{query}"

    here = experiment_link(experiment, "drive-tables/progress")
    return follow(request, identifier, here, "No tables were computed", result_link)
