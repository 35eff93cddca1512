"""New session, second half: check, weigh, confirm, arm, start; one step at a time, each said in words."""

from dataclasses import dataclass
from typing import Annotated

from fastapi import APIRouter, Form, Request
from fastapi.responses import HTMLResponse, Response

from api.pages.experiment_frame import experiment_context
from api.pages.form_input import input_errors_as_problems, typed_mass
from api.pages.layout import experiment_link, frame, session_link
from api.pages.plan_view import plan_view, purpose_words
from api.pages.rendering import PREFIX, Context, page
from api.pages.session_words import outcome
from api.pages.stored_models import StoredExperiment
from api.service import access
from api.service.access import client_address
from api.service.accounts import User
from api.service.database import SessionRow
from api.service.problems import Problem
from api.service.proof_drives import drive_of_proof
from api.service.service import Service
from api.service.session_payload import described
from api.service.unlisted_recordings import RECORDING
from daq.session_events import SessionState
from daq.weighed_mass import require_mass

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
            each.payload.mass
            for each in service.experiments.sessions(experiment)
            if each.file is not None and each.payload.mass is not None
        ]
        current = stored.current()
        context["purpose"] = purpose_words(service.plans.separating_report(row.plan))
        context["view"] = plan_view(
            service.plans.plan(row.plan),
            service.rigs.rig(row.rig),
            described(row.payload),
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
    payload = described(service.experiments.session(experiment, session).payload)

    def weighed() -> float:
        value = typed_mass(mass) if mass.strip() else service.scale.weigh()
        require_mass(payload, value)
        return value

    try:
        with input_errors_as_problems():
            service.sessions.weigh(experiment, session, user, weighed)
    except Problem as refused:
        if refused.status != 422:
            raise
        # Said where it was typed, and what was typed stays there to be corrected.
        return _answer(request, user, experiment, session, typed=mass, refused=refused.detail)
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
    service = access.service_of(request)
    drive = drive_of_proof(service.experiments.session(experiment, session))
    service.sessions.discard(experiment, session, user)
    there = f"{PREFIX}/new-session" if drive is None else experiment_link(experiment, f"proofs/{drive[0]}")
    return Response(status_code=204, headers={"HX-Redirect": there})


def _answer(
    request: Request, user: User, experiment: str, session: str, typed: str = "", refused: str = ""
) -> HTMLResponse:
    context = frame(request, user, "new-session", experiment) | _steps(request, user, experiment, session)
    context |= {"typed": typed, "refused": refused}
    return page(request, "session_steps.html", **context)


def _state_without_processes(row: SessionRow) -> SessionState:
    """Where a session stands that has no processes, such as after the service was started again: at its beginning, unless
    it was over."""
    if row.state == RECORDING or (row.file is not None and row.state == SessionState.RUNNING):
        return SessionState.ABORTED
    state = SessionState(row.state)
    return state if state.ended or row.file is not None else SessionState.NEW


@dataclass(frozen=True)
class ProofRun:
    """A run of a proof: what it sends, and in words what is to be known of that before it moves."""

    number: str
    link: str
    sends: bool
    part: str
    share: float
    words: tuple[str, ...]


def _proof(service: Service, row: SessionRow) -> ProofRun | None:
    """What the operator must know of a drive of a proof before it moves; None for a session of the experiment itself."""
    drive = drive_of_proof(row)
    if drive is None:
        return None
    number, which = drive
    state = service.proofs.get(row.experiment, number)
    return ProofRun(
        number=number,
        link=experiment_link(row.experiment, f"proofs/{number}"),
        sends=which == "with",
        part=("its friction alone" if state.settings.part == "friction" else "the whole model"),
        share=state.settings.share,
        words=(service.proofs.words(row.experiment, number) if which == "with" else ()),
    )


def _steps(request: Request, user: User, experiment: str, session: str) -> Context:
    service = access.service_of(request)
    row = service.experiments.session(experiment, session)
    active = service.sessions.active(row.rig or "")
    ours = active is not None and (active.experiment, active.id) == (experiment, session)
    if row.rig is None:
        raise Problem(404, f"The session {session} was not measured here; its samples are on the model page.")
    live = active.payload_session if active is not None and ours else None
    state = live.state if live is not None else _state_without_processes(row)
    rig_check = live.rig_check if live is not None else None
    items = list(rig_check.items) if rig_check is not None else []
    return {
        "session": row,
        "other_rig": service.catalogue.other_rig(experiment, row.rig)
        if live is None or live.file is None
        else None,
        "state": state,
        "reached": STATES.index(state),
        "outcome": outcome(service, row) if state.ended or row.state == RECORDING else None,
        "restarted": live is None and not state.ended and row.state != SessionState.NEW,
        "passed": [item for item in items if item.ok],
        "failed": [item for item in items if not item.ok],
        "typed": "",
        "refused": "",
        "weighed": row.weighed,
        "confirmed": ours and active is not None and service.sessions.is_confirmed(active),
        "scale": service.settings.scale_port is not None,
        "step_link": session_link(experiment, session),
        "proof": _proof(service, row),
        "operator": service.operators.operator(row.rig),
        "theirs": service.operators.operator(row.rig) not in (None, user.name),
    }
