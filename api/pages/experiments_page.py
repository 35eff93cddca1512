"""The list of experiments: how good the model of each is, and where to go on."""

from fastapi import APIRouter, Request
from fastapi.responses import HTMLResponse

from api.pages.layout import experiment_link, frame
from api.pages.number_format import utc_time
from api.pages.rendering import PREFIX, Context, page
from api.service import access
from api.service.database import ExperimentRow
from api.service.model_story import ModelStory
from api.service.service import Service
from api.service.unlisted_recordings import RECORDING
from identify.results.diagnosis import DiagnosisDocument

FIRST_RIG = "rx130l-joint3-simulated"
"""For whoever has no experiment yet: one joint, simulated."""

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
        "simulated_link": _simulated_link(service) if not rows else None,
    }
    return page(request, "experiments.html", **context)


def _simulated_link(service: Service) -> str | None:
    """The way to a first session on the arm that comes with the service; None where its rig is not there."""
    if FIRST_RIG not in service.rigs.files():
        return None
    return f"{PREFIX}/new-session?rig={FIRST_RIG}"


def _row(service: Service, row: ExperimentRow) -> Context:
    shown: Context = {
        "id": row.id,
        "name": row.name,
        "problem": row.problem,
        "joints": row.joints,
        "modified": utc_time(row.modified),
        "links": {
            step: experiment_link(row.id, step) for step in ("model", "missing", "results", "sessions")
        },
        "sessions": 0,
        "cut_off": 0,
        "payloads": [],
        "model": None,
        "error": None,
        "validation": None,
        "verdict": None,
    }
    if row.problem:
        return shown
    sessions = service.experiments.sessions(row.id)
    shown["sessions"] = sum(session.file is not None for session in sessions)
    shown["cut_off"] = sum(session.state == RECORDING for session in sessions)
    shown["payloads"] = list(dict.fromkeys(session.payload["name"] for session in sessions))
    stored = ModelStory(service.experiments.folder(row.id))
    current = stored.read().current
    if current is None:
        return shown
    diagnosis = stored.diagnosis(current.id)
    return shown | {
        "model": " + ".join([current.model, *current.add]),
        "error": current.fit.relative_error,
        "validation": current.fit.relative_error_validation,
        "verdict": _worst(diagnosis),
    }


def _worst(diagnosis: DiagnosisDocument | None) -> str | None:
    """The verdict that asks for most: missing before unexplained before adequate."""
    if diagnosis is None:
        return None
    verdicts = {joint.verdict for joint in diagnosis.joints}
    return next((verdict for verdict in ("missing", "unexplained", "adequate") if verdict in verdicts), None)
