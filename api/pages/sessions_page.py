"""The sessions of an experiment: what became of each, its files, recovery of one that was cut off, and adding one from a
file; and the upload of a whole experiment.
"""

from typing import Annotated, Literal

from fastapi import APIRouter, File, Form, Request, UploadFile
from fastapi.responses import HTMLResponse, Response

from api.pages.experiment_frame import experiment_context
from api.pages.form_input import input_errors_as_problems, typed_mass
from api.pages.layout import experiment_link, frame
from api.pages.rendering import PREFIX, Context, page
from api.pages.stored_models import StoredExperiment
from api.service import access
from api.service.accounts import User
from api.service.database import SessionRow
from api.service.folder_description import INCOMPLETE
from api.service.payload_sessions import ENDED_EARLY, RECORDING
from api.service.problems import Problem
from api.service.service import Service
from daq.session_events import SessionState
from identify.recording import Payload
from identify.recording.plain_text import check_printable

router = APIRouter(prefix=PREFIX, include_in_schema=False)

NEW = "new"
"""Value of the choice `another payload`."""
MEBIBYTE = 1024 * 1024

ON_THEIR_WAY = frozenset(state.value for state in SessionState if not state.ended)
"""States of a session that is being prepared or measured."""
STATE_WORDS = {
    "measured": ("good", "measured"),
    "complete": ("good", "measured"),
    "done": ("good", "measured"),
    "aborted": ("warn", "stopped; kept, not used"),
    "faulted": ("fault", "ended by a fault; kept, not used"),
    "damaged": ("fault", "the file cannot be read"),
    "missing": ("fault", "the file is not there"),
    RECORDING: ("warn", "cut off while it was recorded"),
}
"""State of a session -> its colour, and what an operator calls it; others are on their way to be measured."""


@router.get("/experiments/{experiment}/sessions")
def sessions_page(request: Request, user: access.Viewer, experiment: str) -> HTMLResponse:
    """The page."""
    return page(request, "sessions.html", **_context(request, user, experiment))


@router.post("/experiments/{experiment}/sessions/{session}/recover")
def recover(request: Request, user: access.Operator, experiment: str, session: str) -> HTMLResponse:
    """Close a recording that was cut off; what was measured until then is kept."""
    with input_errors_as_problems():
        access.service_of(request).sessions.recover(experiment, session, user)
    return page(request, "sessions_body.html", **_context(request, user, experiment))


@router.post("/experiments/{experiment}/sessions/{session}/admit")
def admit(request: Request, user: access.Operator, experiment: str, session: str) -> HTMLResponse:
    """Use a session that ended early: whoever presses this has looked at it."""
    with input_errors_as_problems():
        access.service_of(request).sessions.admit(experiment, session, user)
    return page(request, "sessions_body.html", **_context(request, user, experiment))


@router.post("/experiments/{experiment}/sessions/import")
def add_session(
    request: Request,
    user: access.Operator,
    experiment: str,
    file: Annotated[UploadFile, File()],
    payload: Annotated[str, Form(max_length=100)],
    role: Annotated[Literal["identification", "validation"], Form()] = "identification",
    payload_name: Annotated[str, Form(max_length=64)] = "",
    mass: Annotated[str, Form(max_length=20)] = "",
) -> Response:
    """Add a session that was measured elsewhere; all sessions are identified anew."""
    service = access.service_of(request)
    new = None
    if payload == NEW:
        payload = payload_name.strip()
        if not payload:
            raise Problem(422, "Give the new payload a name.")
        try:
            new = Payload(name=check_printable(payload), mass=typed_mass(mass))
        except ValueError as error:
            raise Problem(422, f"The name of the payload {error}.") from error
    with input_errors_as_problems():
        service.jobs.refuse_more(user.name)
        service.disk.require_room()
        service.uploads.add_session(experiment, file.file, file.filename or "", payload, role, new)
    service.models.refit(experiment, user.name)
    return Response(status_code=204, headers={"HX-Redirect": experiment_link(experiment, "sessions")})


@router.post("/experiments/import")
def add_experiment(request: Request, user: access.Operator, file: Annotated[UploadFile, File()]) -> Response:
    """Store an experiment that was measured elsewhere; it is identified at once."""
    service = access.service_of(request)
    with input_errors_as_problems():
        service.jobs.refuse_more(user.name)
        service.disk.require_room()
        row = service.uploads.add_experiment(file.file)
    service.models.refit(row.id, user.name)
    return Response(status_code=204, headers={"HX-Redirect": experiment_link(row.id, "sessions")})


def _context(request: Request, user: User, experiment: str) -> Context:
    service = access.service_of(request)
    stored = StoredExperiment(service.experiments, experiment)
    shown = stored.current()
    errors = {each.file: each.relative_error for each in shown.document.sessions} if shown else {}
    rows = [_session(service, experiment, row, errors) for row in service.experiments.sessions(experiment)]
    context = frame(request, user, "sessions", experiment)
    context |= experiment_context(stored, stored.joint_names[0], shown, "sessions")
    return context | {
        "rows": rows,
        "cut_off": [row for row in rows if row["recoverable"]],
        "payloads": stored.declared.payloads,
        "upload_limit": service.settings.upload_limit,
        "add_link": experiment_link(experiment, "sessions/import"),
    }


def _session(service: Service, experiment: str, row: SessionRow, errors: dict[str, float | None]) -> Context:
    tone, words = STATE_WORDS.get(row.state, ("idle", row.state))
    if row.state in ENDED_EARLY and not row.file:
        words = words.replace("kept, not used", "nothing was measured")
    elif row.state in ENDED_EARLY and row.file and not row.file.startswith(INCOMPLETE):
        words = words.replace("kept, not used", "used as far as it goes")
    link = experiment_link(experiment, f"sessions/{row.id}")
    active = service.sessions.active(row.rig or "")
    under_way = (
        active is not None
        and (active.experiment, active.id) == (experiment, row.id)
        and not active.state.ended
    )
    file = service.experiments.folder(experiment) / row.file if row.file else None
    there = file is not None and file.is_file()
    formats = []
    if there and file is not None:
        formats = [("original", file.suffix.lstrip(".").upper())]
        formats += [("csv", "CSV")] if file.suffix == ".h5" and row.state != RECORDING else []
        formats += [("raw", "raw frames")] if file.with_suffix(".log").is_file() else []
    return {
        "id": row.id,
        "payload": row.payload,
        "role": row.role,
        "tone": tone,
        "state": "the robot moves" if under_way and row.state == RECORDING else words,
        "reason": row.reason or "",
        "error": errors.get(row.file or ""),
        "megabytes": file.stat().st_size / MEBIBYTE if there and file is not None else None,
        "downloads": [
            {"name": name, "link": f"/experiments/{experiment}/recordings/{row.id}?format={kind}"}
            for kind, name in formats
        ],
        "recoverable": row.state == RECORDING and not under_way,
        "recover_link": f"{link}/recover",
        "admissible": row.state in ENDED_EARLY and there and (row.file or "").startswith(INCOMPLETE),
        "admit_link": f"{link}/admit",
        "go_on_link": link if row.file is None and row.state in ON_THEIR_WAY else None,
    }
