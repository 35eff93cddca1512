"""New session, second half: check, weigh, confirm, arm, start; one step at a time, each said in words."""

from typing import Annotated

from fastapi import APIRouter, Form, Request
from fastapi.responses import HTMLResponse, Response

from api.pages.experiment_frame import experiment_context
from api.pages.form_input import input_errors_as_problems, typed_mass
from api.pages.layout import experiment_link, frame, session_link
from api.pages.plan_view import plan_view, purpose_words
from api.pages.rendering import PREFIX, Context, page
from api.pages.stored_models import StoredExperiment
from api.service import access
from api.service.access import client_address
from api.service.accounts import User
from api.service.problems import Problem
from daq.session_events import SessionState
from identify.recording.experiment_file import Payload

router = APIRouter(
    prefix=f"{PREFIX}/experiments/{{experiment}}/sessions/{{session}}", include_in_schema=False
)

STATES = list(SessionState)


@router.get("")
def session_page(request: Request, user: access.Viewer, experiment: str, session: str) -> HTMLResponse:
    """The session that is being prepared, or what became of it."""
    service = access.service_of(request)
    stored = StoredExperiment(service.experiments, experiment)
    context = frame(request, user, "new-session", experiment)
    context |= experiment_context(stored, stored.joint_names[0], None, "model")
    context |= _steps(request, user, experiment, session)
    row = service.experiments.session(experiment, session)
    context |= {"view": None, "purpose": None}
    if row.rig and row.plan and row.rig in service.rigs.files() and row.plan in service.plans.ids():
        measured = [
            each.payload["mass"] for each in service.experiments.sessions(experiment) if each.file is not None
        ]
        current = stored.current()
        context["purpose"] = purpose_words(service.plans.report(row.plan))
        context["view"] = plan_view(
            service.plans.plan(row.plan),
            service.rigs.rig(row.rig),
            Payload.model_validate(row.payload),
            measured,
            current.document if current else None,
        )
    return page(request, "session.html", **context)


@router.get("/steps")
def steps(request: Request, user: access.Viewer, experiment: str, session: str) -> HTMLResponse:
    """The part that changes."""
    return _answer(request, user, experiment, session)


@router.post("/check")
def check(request: Request, user: access.Operator, experiment: str, session: str) -> HTMLResponse:
    """Take the bus and look at every node; nothing is powered."""
    with input_errors_as_problems():
        access.service_of(request).sessions.check(experiment, session, user)
    return _answer(request, user, experiment, session)


@router.post("/weigh")
def weigh(
    request: Request,
    user: access.Operator,
    experiment: str,
    session: str,
    mass: Annotated[str, Form(max_length=20)] = "",
) -> HTMLResponse:
    """Note the mass that was typed, or ask the scale."""
    service = access.service_of(request)
    service.sessions.weigh(
        experiment, session, user, (lambda: typed_mass(mass)) if mass.strip() else service.scale.weigh
    )
    return _answer(request, user, experiment, session)


@router.post("/confirm")
def confirm(request: Request, user: access.Operator, experiment: str, session: str) -> HTMLResponse:
    """This payload is mounted."""
    with input_errors_as_problems():
        access.service_of(request).sessions.confirm(experiment, session, user)
    return _answer(request, user, experiment, session)


@router.post("/arm")
def arm(request: Request, user: access.Operator, experiment: str, session: str) -> HTMLResponse:
    """Recorder and monitors run; the next step moves the robot."""
    with input_errors_as_problems():
        access.service_of(request).sessions.arm(experiment, session, user, client_address(request))
    return _answer(request, user, experiment, session)


@router.post("/start")
def start(request: Request, user: access.Operator, experiment: str, session: str) -> Response:
    """Move the robot, and watch it."""
    with input_errors_as_problems():
        access.service_of(request).sessions.start(experiment, session, user, client_address(request))
    return Response(status_code=204, headers={"HX-Redirect": f"{PREFIX}/live"})


@router.post("/discard")
def discard(request: Request, user: access.Operator, experiment: str, session: str) -> Response:
    """Forget a session that was not measured."""
    access.service_of(request).sessions.discard(experiment, session, user)
    return Response(status_code=204, headers={"HX-Redirect": f"{PREFIX}/new-session"})


def _answer(request: Request, user: User, experiment: str, session: str) -> HTMLResponse:
    context = frame(request, user, "new-session", experiment) | _steps(request, user, experiment, session)
    return page(request, "session_steps.html", **context)


def _steps(request: Request, user: User, experiment: str, session: str) -> Context:
    service = access.service_of(request)
    row = service.experiments.session(experiment, session)
    active = service.sessions.active(row.rig or "")
    ours = active is not None and (active.experiment, active.id) == (experiment, session)
    if row.rig is None:
        raise Problem(404, f"The session {session} was not measured here; its samples are on the model page.")
    live = active.payload_session if active is not None and ours else None
    state = live.state if live is not None else SessionState(row.state)
    rig_check = live.rig_check if live is not None else None
    return {
        "session": row,
        "other_rig": service.catalogue.other_rig(experiment, row.rig)
        if live is None or live.file is None
        else None,
        "state": state,
        "reached": STATES.index(state),
        "reason": (live.reason if live is not None else row.reason) or "",
        "check_items": list(rig_check.items) if rig_check is not None else [],
        "weighed": row.weighed,
        "confirmed": ours and active is not None and service.sessions.is_confirmed(active),
        "scale": service.settings.scale_port is not None,
        "step_link": session_link(experiment, session),
        "model_link": experiment_link(experiment, "model"),
        "operator": service.operators.operator(row.rig),
        "theirs": service.operators.operator(row.rig) not in (None, user.name),
    }
