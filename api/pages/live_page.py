"""Live: what the robot does now, readable from two metres; afterwards what happened, and the next step."""

import json
from dataclasses import asdict, dataclass

from fastapi import APIRouter, Request
from fastapi.responses import HTMLResponse

from api.pages.choices import RigChoice, chosen_rig
from api.pages.error_figures import JointUnits
from api.pages.layout import frame
from api.pages.rendering import PREFIX, page
from api.pages.session_words import NO_SESSION, STATES, Outcome, outcome
from api.service import access
from api.service.problems import Problem
from api.service.service import Service
from daq.rig import Rig
from daq.session_events import SessionState
from identify.recording.errors import InputError

router = APIRouter(prefix=PREFIX, include_in_schema=False)

MANY = 2
"""Axes from which on they share the screen, each with fewer and smaller figures."""


@router.get("/live")
def live_page(request: Request, user: access.Viewer, rig: RigChoice = None) -> HTMLResponse:
    """The page of the rig that moves, else of the one looked at last; the browser fills it from the WebSocket."""
    service = access.service_of(request)
    moving = service.sessions.under_way()
    rig_id = chosen_rig(request, rig or (moving.rig if moving else None))
    try:
        settings = service.rigs.rig(rig_id)
    except InputError as error:
        raise Problem(422, f"The rig's file is wrong: {error}") from error
    active = service.sessions.active(rig_id)
    states = {state.value: asdict(each) | {"moves": _moves(state)} for state, each in STATES.items()}
    return page(
        request,
        "live.html",
        **frame(request, user, "live"),
        rig_id=rig_id,
        axes=[_axis(settings, index) for index in range(len(settings.axes))],
        many=len(settings.axes) >= MANY,
        cycle=settings.cycle,
        active=active,
        outcome=_outcome(service, rig_id),
        states=json.dumps(states | {"": asdict(NO_SESSION) | {"moves": False}}),
    )


@router.get("/live/outcome")
def live_outcome(request: Request, _user: access.Viewer, rig: RigChoice = None) -> HTMLResponse:
    """What became of the rig's last session, for a page that watched it."""
    rig_id = chosen_rig(request, rig)
    return page(request, "outcome.html", outcome=_outcome(access.service_of(request), rig_id))


def _outcome(service: Service, rig: str) -> Outcome | None:
    row = service.experiments.newest_on_rig(rig)
    return None if row is None else outcome(service, row)


def _moves(state: SessionState) -> bool:
    return state in (SessionState.ARMED, SessionState.RUNNING)


@dataclass(frozen=True)
class LiveAxis:
    """What the page draws of an axis, with its limits; small angles are read in mrad, small ways in mm.

    gain : JSON, the axis's row of the drive gain matrix
    """

    joint: str
    units: JointUnits
    small: str
    current_limit: float
    following_limit: float
    temperature_limit: float | None
    low: float
    high: float
    gain: str
    temperature: bool


def _axis(settings: Rig, index: int) -> LiveAxis:
    axis = settings.axes[index]
    units = JointUnits.of(settings.robot.joints[index].type)
    limits = axis.limits
    return LiveAxis(
        joint=axis.joint,
        units=units,
        small=("mrad" if units.position == "rad" else "mm"),
        current_limit=limits.current,
        following_limit=limits.following_error,
        temperature_limit=(limits.temperature if settings.record_temperature else None),
        low=limits.position[0],
        high=limits.position[1],
        gain=json.dumps([float(gain) for gain in settings.drive_gain[index]]),
        temperature=settings.record_temperature,
    )
