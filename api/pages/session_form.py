"""New session, first half: rig, experiment, payload and plan, with a preview of the motion."""

from contextlib import suppress
from dataclasses import dataclass
from typing import Annotated, Literal
from urllib.parse import urlencode

from fastapi import APIRouter, Form, Query, Request
from fastapi.responses import HTMLResponse, RedirectResponse, Response

from api.pages.choices import RigChoice, chosen_rig
from api.pages.form_input import input_errors_as_problems
from api.pages.job_views import follow
from api.pages.layout import LAST_EXPERIMENT, frame, session_link
from api.pages.plan_view import plan_view, purpose_words
from api.pages.rendering import PREFIX, Context, page
from api.service import access
from api.service.database import ExperimentRow
from api.service.jobs import Job
from api.service.model_story import ModelStory
from api.service.problems import Problem
from api.service.service import Service
from daq.rig import Rig, with_lab_name
from daq.session_events import SessionState
from identify.recording.errors import InputError
from identify.recording.experiment_file import Payload

router = APIRouter(prefix=PREFIX, include_in_schema=False)

NEW = "new"
"""Value of the choice `another one` for experiments and payloads."""
Choice = Annotated[str | None, Query(max_length=100)]
Kilogram = Annotated[float, Form(ge=0, le=1e5, allow_inf_nan=False)]
Metre = Annotated[float, Form(ge=-100, le=100, allow_inf_nan=False)]


@router.get("/new-session")
def new_session_page(
    request: Request,
    user: access.Viewer,
    rig: RigChoice = None,
    experiment: Choice = None,
    payload: Choice = None,
    plan: Choice = None,
    drawn_for: Choice = None,
) -> Response:
    """The form; while a session is being prepared on the rig, that session.

    drawn_for : the rig that the form was drawn for; once another is chosen, what was chosen for it no longer holds
    """
    service = access.service_of(request)
    rig_id = chosen_rig(request, rig)
    if drawn_for is not None and drawn_for != rig_id:
        experiment = payload = plan = None
    active = service.sessions.active(rig_id)
    if active is not None and not active.state.ended and rig is None:
        return RedirectResponse(session_link(active.experiment, active.id))
    context = frame(request, user, "new-session")
    try:
        settings = service.rigs.rig(rig_id)
    except InputError as error:
        raise Problem(422, f"The rig's file is wrong: {error}") from error
    choice = _chosen(request, service, settings, rig_id, experiment, payload, plan)
    context |= choice | {"rigs": list(service.rigs.files()), "rig_id": rig_id, "settings": settings}
    context |= {"proof": None}
    return page(request, "new_session.html", **context)


@router.post("/new-session")
def prepare(
    request: Request,
    user: access.Operator,
    rig: Annotated[str, Form(max_length=64)],
    experiment: Annotated[str, Form(max_length=64)],
    payload: Annotated[str, Form(max_length=64)],
    plan: Annotated[str, Form(max_length=64)],
    role: Annotated[Literal["identification", "validation"], Form()] = "identification",
    experiment_name: Annotated[str, Form(max_length=64)] = "",
    payload_name: Annotated[str, Form(max_length=64)] = "",
    mass: Kilogram = 0.0,
    com_x: Metre = 0.0,
    com_y: Metre = 0.0,
    com_z: Metre = 0.0,
) -> Response:
    """Prepare a session and go on to its steps; a new experiment is made on the way."""
    service = access.service_of(request)
    with input_errors_as_problems():
        settings = service.rigs.rig(rig)
        given = _payload(payload_name, mass, (com_x, com_y, com_z)) if payload == NEW else None
        known = given or _known_payload(service, settings, experiment, payload)
        service.disk.require_room()
        if experiment == NEW:
            name = experiment_name.strip() or rig  # which the empty field shows
            declared = service.rigs.experiment_file(rig, name)
            service.sessions.require_preparable(declared, rig=rig, plan=plan, payload=known)
            service.operators.take(rig, user)
            experiment = service.experiments.create(declared).id
        row = service.sessions.create(experiment, user, rig=rig, plan=plan, payload=known, role=role)
    service.live.tell(rig)
    return Response(status_code=204, headers={"HX-Redirect": session_link(experiment, row.id)})


@router.post("/plans")
def make_plan(
    request: Request,
    user: access.Operator,
    rig: Annotated[str, Form(max_length=64)],
    seconds: Annotated[float, Form(gt=0, le=3600)],
    experiment: Annotated[str, Form(max_length=64)] = "",
    payload: Annotated[str, Form(max_length=64)] = "",
) -> HTMLResponse:
    """Plan a motion within the rig's limits; progress until it is there."""
    service = access.service_of(request)
    with input_errors_as_problems():
        job = service.planner.plan(rig, user.name, f"{rig} {seconds:g} s", seconds, "load-velocity", 0)
    return _follow_plan(request, job.id, {"rig": rig, "experiment": experiment, "payload": payload})


@router.get("/plans/progress")
def plan_progress(
    request: Request,
    _user: access.Viewer,
    job: Annotated[str, Query(max_length=32)],
    rig: Annotated[str, Query(max_length=64)],
    experiment: Choice = None,
    payload: Choice = None,
) -> HTMLResponse:
    """How far the planning is; then the form with the new plan chosen."""
    return _follow_plan(request, job, {"rig": rig, "experiment": experiment or "", "payload": payload or ""})


def _follow_plan(request: Request, job_id: str, kept: dict[str, str]) -> HTMLResponse:
    def form_with_plan(job: Job) -> str:
        return f"{PREFIX}/new-session?{urlencode(kept | {'plan': job.result.plan})}"

    return follow(
        request,
        job_id,
        f"{PREFIX}/plans/progress",
        "No plan was made",
        form_with_plan,
        kept,
    )


def _payload(name: str, mass: float, com: tuple[float, float, float]) -> Payload:
    """A payload that was typed."""
    try:
        return with_lab_name(Payload(name=name.strip(), mass=mass, com=com))
    except ValueError:
        raise InputError(
            f"payload name {name.strip()!r}: use letters, digits, '_', '.' and '-', a letter or digit first"
        ) from None


def _known_payload(service: Service, settings: Rig, experiment: str, payload: str) -> Payload:
    """A payload by name: the experiment's own, else the rig's."""
    declared = {} if experiment == NEW else _payloads_of(service, experiment)
    return declared.get(payload) or settings.payload(payload)


def _payloads_of(service: Service, experiment: str) -> dict[str, Payload]:
    """The payloads that the experiment's file declares, as a session takes them; those with other names than a rig may
    give are left out."""
    payloads = {}
    for each in service.experiments.declared(experiment).payloads:
        with suppress(ValueError):
            payloads[each.name] = with_lab_name(each)
    return payloads


def _chosen(
    request: Request,
    service: Service,
    settings: Rig,
    rig_id: str,
    experiment: str | None,
    payload: str | None,
    plan: str | None,
) -> Context:
    """The choices of the form and what is chosen, with the preview of the plan."""
    joints = [axis.joint for axis in settings.axes]
    rows = [row for row in service.experiments.rows() if not row.problem and row.joints == joints]
    chosen = _experiment(service, rows, rig_id, experiment, request.session.get(LAST_EXPERIMENT))
    plans = [(each, service.plans.plan(each)) for each in service.plans.ids()]
    plans = [(each, made) for each, made in plans if made.joints == tuple(joints)]
    made = next(((each, one) for each, one in plans if each == plan), plans[0] if plans else None)
    known = {each.name: each for each in settings.payloads}
    known |= _payloads_of(service, chosen.id) if chosen is not None else {}
    known_payload = known.get(payload or "") or next(iter(known.values()))
    sessions = service.experiments.sessions(chosen.id) if chosen else []
    measured = [row.payload.mass for row in sessions if row.file is not None and row.payload.mass is not None]
    document = None
    if chosen is not None:
        story = ModelStory(service.experiments.folder(chosen.id))
        current = story.read().current
        document = story.identification(current.id) if current else None
    view = plan_view(made[1], settings, known_payload, measured, document) if made else None
    return {
        "experiments": rows,
        "other_rig": service.catalogue.other_rig(chosen.id, rig_id) if chosen is not None else None,
        "experiment": chosen,
        "payloads": list(known.values()),
        "payload": known_payload,
        "other_payload": payload == NEW,
        "plans": [(each, one.name or each, one.duration) for each, one in plans],
        "plan_id": made[0] if made else None,
        "view": view,
        "purpose": purpose_words(service.plans.separating_report(made[0])) if made else None,
        "measured": [row for row in sessions if row.file is not None],
        "waiting": _waiting(service, chosen),
    }


def _experiment(
    service: Service, rows: list[ExperimentRow], rig: str, asked: str | None, last: str | None
) -> ExperimentRow | None:
    """The experiment that was asked for; else, of those whose sessions were measured on this rig alone, the one that was
    looked at last, or that was changed last. None for a new one: another rig's is never taken by itself."""
    if asked is not None:
        return next((row for row in rows if row.id == asked), None)
    measured = [row for row in rows if service.catalogue.rigs(row.id) == [rig]]
    measured = [row for row in measured if service.catalogue.other_rig(row.id, rig) is None]
    return next((row for row in measured if row.id == last), measured[0] if measured else None)


@dataclass(frozen=True)
class WaitingSession:
    """A session that was prepared."""

    id: str
    link: str


def _waiting(service: Service, experiment: ExperimentRow | None) -> WaitingSession | None:
    """A session of the experiment that was prepared and neither measured nor discarded."""
    if experiment is None:
        return None
    for row in service.experiments.sessions(experiment.id):
        if row.file is None and not SessionState(row.state).ended:
            return WaitingSession(row.id, session_link(experiment.id, row.id))
    return None
