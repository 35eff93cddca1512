"""Rig: nodes, states, limits, calibration, faults in words, and what to do next."""

from dataclasses import dataclass
from datetime import datetime
from typing import Annotated

from fastapi import APIRouter, Form, Query, Request
from fastapi.responses import HTMLResponse, Response

from api.pages.choices import RigChoice, chosen_rig
from api.pages.error_figures import JointUnits
from api.pages.layout import experiment_link, frame
from api.pages.number_format import moment, significant, utc_time
from api.pages.rendering import PREFIX, Context, page
from api.pages.rig_users import onlooker_words
from api.pages.session_words import STATES, for_a_page
from api.service import access
from api.service.active_session import ActiveSession
from api.service.problems import Problem
from api.service.service import Service
from daq.rig import Limits, Rig
from daq.rig_check import CheckItem
from daq.session_events import SessionEvent
from identify.recording.errors import InputError

router = APIRouter(prefix=PREFIX, include_in_schema=False)


@router.get("/rig")
def rig_page(request: Request, user: access.Viewer, rig: RigChoice = None) -> HTMLResponse:
    """The page of one rig, with tabs for the others."""
    service = access.service_of(request)
    context: Context = frame(request, user, "rig")
    files = service.rigs.files()
    if not files:
        return page(request, "rig.html", **context, rigs=[], rig_id=None)
    rig_id = chosen_rig(request, rig)
    context |= {
        "rigs": [{"id": each, "here": each == rig_id, "link": f"{PREFIX}/rig?rig={each}"} for each in files],
        "rig_id": rig_id,
    }
    return page(request, "rig.html", **(context | rig_context(service, rig_id, user.name)))


@router.get("/rig/state")
def rig_state(
    request: Request, user: access.Viewer, rig: Annotated[str, Query(max_length=64)]
) -> HTMLResponse:
    """The part of the page that changes by itself."""
    service = access.service_of(request)
    service.operators.watch(rig, user)
    context: Context = frame(request, user, "rig") | {"rig_id": rig}
    context |= rig_context(service, rig, user.name)
    return page(request, "rig_body.html", **context)


@router.post("/rig/take")
def take(request: Request, user: access.Operator, rig: Annotated[str, Form(max_length=64)]) -> Response:
    """Have the rig."""
    service = access.service_of(request)
    service.operators.take(_known(service, rig), user)
    service.live.tell(rig)
    return rig_state(request, user, rig)


@router.post("/rig/home")
def home(
    request: Request,
    user: access.Operator,
    rig: Annotated[str, Form(max_length=64)],
    joint: Annotated[str, Form(max_length=64)],
) -> Response:
    """Home a joint."""
    service = access.service_of(request)
    service.homings.start(_known(service, rig), user, joint=joint, client=access.client_address(request))
    return rig_state(request, user, rig)


@router.post("/rig/reset")
def reset(request: Request, user: access.Operator, rig: Annotated[str, Form(max_length=64)]) -> Response:
    """Reset the faults of the drives."""
    service = access.service_of(request)
    service.drive_resets.reset(_known(service, rig), user, access.client_address(request))
    return rig_state(request, user, rig)


@router.post("/rig/release")
def release(request: Request, user: access.Operator, rig: Annotated[str, Form(max_length=64)]) -> Response:
    """Give the rig back."""
    service = access.service_of(request)
    service.operators.release(_known(service, rig), user)
    service.live.tell(rig)
    return rig_state(request, user, rig)


@dataclass(frozen=True)
class AxisLine:
    """An axis as its rig's file has it: gain in N m or N per unit of command, gear in motor turns, counts of its encoder."""

    joint: str
    node: int
    drive: str
    units: JointUnits
    limits: Limits
    gain: float
    gear: float
    counts: float
    home: float


@dataclass(frozen=True)
class EventLine:
    """Something that happened in a session."""

    time: datetime
    words: str
    kind: str


@dataclass(frozen=True)
class RigState:
    """A rig's state in words, what to do, and what became of the samples."""

    kind: str
    words: str
    todo: str
    kept: str
    sessions_link: str


def rig_context(service: Service, rig_id: str, own_name: str) -> Context:
    """What is known of a rig now."""
    try:
        settings = service.rigs.rig(rig_id)
    except InputError as error:
        return {"settings": None, "broken": str(error), "state": None}
    active = service.sessions.active(rig_id)
    operator = service.operators.operator(rig_id)
    return {
        "settings": settings,
        "broken": None,
        "operator": operator,
        "mine": operator == own_name,
        "onlookers": onlooker_words(service, rig_id, own_name),
        "state": _state(service, active),
        "axes": [_axis(settings, index) for index in range(len(settings.axes))],
        "passed": [item for item in _checks(active) if item.ok],
        "failed": [item for item in _checks(active) if not item.ok],
        "calibration": _calibration(service, rig_id, settings),
        "events": [_event(event) for event in reversed(active.events[-12:])] if active else [],
        "active": active,
        "moving": active is not None and active.moves,
        "homed_by_drive": [
            axis.joint
            for axis in settings.axes
            if axis.homing == "drive" and settings.bus.interface != "virtual"
        ],
        "homing": service.homings.run(rig_id),
        "drives_last": settings.bus.interface != "virtual",
        "resets": service.drive_resets.last(rig_id),
    }


def _checks(active: ActiveSession | None) -> list[CheckItem]:
    """What the last check of every node found."""
    check = active.payload_session.rig_check if active is not None else None
    return list(check.items) if check is not None else []


def _calibration(service: Service, rig_id: str, settings: Rig) -> list[tuple[str, str]]:
    """Where the scaling comes from: the rig's file and when it was changed last."""
    changed = utc_time(service.rigs.files()[rig_id].stat().st_mtime)
    gains = [
        f"{axis.joint}\u00a0{significant(settings.drive_gain[i, i], 5)}"
        for i, axis in enumerate(settings.axes)
    ]
    return [("rig file changed", moment(changed)), ("drive gains, eq. (4)", ", ".join(gains))]


def _state(service: Service, active: ActiveSession | None) -> RigState:
    """The rig's state in words, and what to do."""
    if active is None:
        return RigState(
            kind="idle",
            words="At rest, bus closed",
            todo="Plan a session; its first step checks every node without powering it.",
            kept="",
            sessions_link="",
        )
    state, reason = active.state.value, for_a_page(service.sessions.reason(active))
    todo = {
        "new": "A session is being prepared: continue it and check the rig.",
        "checked": "Weigh and mount the payload, then confirm it.",
        "payload confirmed": "Clear the robot's space, then arm.",
        "armed": "Start moves the robot. STOP is at the bottom of every page and on the Esc key.",
        "running": "Watch it on the live page.",
        "done": "Look at the model, or measure the next payload.",
        "aborted": "Somebody stopped it. Find out why before the next session; what was measured is kept.",
        "faulted": "Read the reason, remove the cause at the machine, then check the rig again; what was measured is kept.",
    }[state]
    # What happened stands large; what became of the samples beneath it, with the way to them.
    cause, _, kept = reason.partition("; ")
    kind = {"faulted": "fault", "aborted": "warn", "armed": "warn", "running": "warn"}.get(state, "good")
    return RigState(
        kind=kind,
        words=_said_of(STATES[active.state].long, cause),
        todo=todo,
        kept=(f"{kept[0].upper()}{kept[1:]}." if kept else ""),
        sessions_link=experiment_link(active.experiment, "sessions"),
    )


def _said_of(state: str, cause: str) -> str:
    """A state with its cause, which may say the state itself: `Stopped by ada`."""
    if cause.lower().startswith(state.lower()):
        return f"{cause[0].upper()}{cause[1:]}"
    return f"{state}: {cause}" if cause else state


def _axis(settings: Rig, index: int) -> AxisLine:
    axis = settings.axes[index]
    units = JointUnits.of(settings.robot.joints[index].type)
    return AxisLine(
        joint=axis.joint,
        node=axis.node,
        drive=axis.drive,
        units=units,
        limits=axis.limits,
        gain=float(settings.drive_gain[index, index]),
        gear=float(settings.motor_gear[index, index]),
        counts=axis.encoder_counts,
        home=axis.home,
    )


def _event(event: SessionEvent) -> EventLine:
    kind = {"faulted": "fault", "aborted": "warn"}.get(event.state.value, "good")
    return EventLine(event.time, for_a_page(event.words), kind)


def _known(service: Service, rig: str) -> str:
    if rig not in service.rigs.files():
        raise Problem(404, f"There is no rig {rig}.")
    return rig
