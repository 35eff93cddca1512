"""The list of experiments: how good the model of each is, and where to go on."""

from typing import Any

from fastapi import APIRouter, Request
from fastapi.responses import HTMLResponse

from api.pages.account_pages import as_moment
from api.pages.layout import experiment_link, frame
from api.pages.rendering import PREFIX, page
from api.service import access
from api.service.model_story import ModelStory

router = APIRouter(prefix=PREFIX, include_in_schema=False)


@router.get("/experiments")
def experiments_page(request: Request, user: access.Viewer) -> HTMLResponse:
    """All experiments, the one changed last first."""
    service = access.service_of(request)
    rows = [_row(service, row) for row in service.experiments.rows()]
    return page(request, "experiments.html", **frame(request, user, "experiments"), experiments=rows)


def _row(service: Any, row: Any) -> dict[str, Any]:
    shown = {
        "id": row.id,
        "name": row.name,
        "problem": row.problem,
        "joints": row.joints,
        "modified": as_moment(row.modified),
        "links": {step: experiment_link(row.id, step) for step in ("model", "missing", "results")},
        "sessions": 0,
        "payloads": [],
        "model": None,
        "error": None,
        "validation": None,
        "verdict": None,
    }
    if row.problem:
        return shown
    sessions = service.experiments.sessions(row.id)
    shown["sessions"] = len(sessions)
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


def _worst(diagnosis: dict[str, Any] | None) -> str | None:
    """The verdict that asks for most: missing before unexplained before adequate."""
    if diagnosis is None:
        return None
    verdicts = {joint["verdict"] for joint in diagnosis["joints"]}
    return next((verdict for verdict in ("missing", "unexplained", "adequate") if verdict in verdicts), None)
