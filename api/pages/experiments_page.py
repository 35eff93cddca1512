"""The list of experiments: how good the model of each is, and where to go on."""

from dataclasses import dataclass, replace
from datetime import datetime
from typing import Annotated
from urllib.parse import urlencode

from fastapi import APIRouter, Query, Request
from fastapi.responses import HTMLResponse

from api.pages.job_views import follow, polled_progress
from api.pages.layout import experiment_link, frame
from api.pages.number_format import utc_time
from api.pages.rendering import PREFIX, Context, page
from api.service import access
from api.service.database import ExperimentRow
from api.service.jobs import Job
from api.service.model_story import ModelStory
from api.service.service import Service
from api.service.unlisted_recordings import RECORDING
from api.simulated_demo import RIG
from identify.results.diagnosis import DiagnosisDocument

DEMO_LINK = f"{PREFIX}/demo"
DEMO_PROGRESS = f"{DEMO_LINK}/progress"

router = APIRouter(prefix=PREFIX, include_in_schema=False)


@router.get("/experiments")
def experiments_page(request: Request, user: access.Viewer) -> HTMLResponse:
    """All experiments, the one changed last first."""
    service = access.service_of(request)
    rows = [_row(service, row) for row in service.experiments.rows()]
    context = frame(request, user, "experiments")
    context |= {
        "experiments": rows,
        "upload_limit": service.settings.upload_limit,
        "add_link": f"{PREFIX}/experiments/import",
        "demo_link": DEMO_LINK,
        "demo_progress": _demo_under_way(service, user.name) if not rows else None,
        "step_by_step_link": f"{PREFIX}/new-session?{urlencode({'rig': RIG})}",
    }
    return page(request, "experiments.html", **context)


@router.post("/demo")
def start_demo(request: Request, user: access.Operator) -> HTMLResponse:
    """Measure on the simulated arm and fit the first model; progress until it is there."""
    return _follow_demo(request, access.service_of(request).demos.start(user.name).id)


@router.get("/demo/progress")
def demo_progress(
    request: Request, _user: access.Viewer, job: Annotated[str, Query(max_length=32)]
) -> HTMLResponse:
    """How far the demo is; then the results of its experiment."""
    return _follow_demo(request, job)


def _follow_demo(request: Request, job: str) -> HTMLResponse:
    def results(ended: Job) -> str:
        return experiment_link(ended.result.experiment or "", "results")

    return follow(request, job, DEMO_PROGRESS, "Nothing was measured", results)


def _demo_under_way(service: Service, user: str) -> Context | None:
    """Context of the progress of a demo that a user has begun before."""
    job = service.demos.under_way(user)
    return polled_progress(job, DEMO_PROGRESS) if job else None


@dataclass(frozen=True)
class ExperimentLine:
    """An experiment in the list; of one whose file is wrong no more than that is known.

    sessions, cut_off : how many were measured, and how many were cut off
    model, error      : the current model in words, and its relative error; None before the first
    """

    id: str
    name: str
    problem: str | None
    joints: list[str]
    modified: datetime | None
    links: dict[str, str]
    sessions: int = 0
    cut_off: int = 0
    payloads: tuple[str, ...] = ()
    model: str | None = None
    error: float | None = None
    validation: float | None = None
    verdict: str | None = None


def _row(service: Service, row: ExperimentRow) -> ExperimentLine:
    links = {step: experiment_link(row.id, step) for step in ("model", "missing", "results", "sessions")}
    shown = ExperimentLine(row.id, row.name, row.problem, row.joints, utc_time(row.modified), links)
    if row.problem:
        return shown
    sessions = service.experiments.sessions(row.id)
    shown = replace(
        shown,
        sessions=sum(session.file is not None for session in sessions),
        cut_off=sum(session.state == RECORDING for session in sessions),
        payloads=tuple(dict.fromkeys(session.payload.name for session in sessions)),
    )
    stored = ModelStory(service.experiments.folder(row.id))
    current = stored.read().current
    if current is None:
        return shown
    return replace(
        shown,
        model=" + ".join([current.model, *current.add]),
        error=current.fit.relative_error,
        validation=current.fit.relative_error_validation,
        verdict=_worst(stored.diagnosis(current.id)),
    )


def _worst(diagnosis: DiagnosisDocument | None) -> str | None:
    """The verdict that asks for most: missing before unexplained before adequate."""
    if diagnosis is None:
        return None
    verdicts = {joint.verdict for joint in diagnosis.joints}
    return next((verdict for verdict in ("missing", "unexplained", "adequate") if verdict in verdicts), None)
