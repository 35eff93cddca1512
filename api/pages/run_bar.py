"""What every page shows while something moves, and the stop button behind it."""

from typing import Any

from fastapi import APIRouter, Request
from pydantic import BaseModel

from api.pages.number_format import duration
from api.pages.rendering import PREFIX, Context
from api.pages.rig_users import onlooker_words
from api.pages.session_words import NO_SESSION, STATES
from api.service import access
from api.service.homings import HomingRun
from api.service.service import Service
from api.service.stop_requests import everything_stopped

router = APIRouter(prefix=PREFIX, include_in_schema=False)


class RunState(BaseModel):
    """What every page shows of what moves, and of what a person must do at once."""

    running: bool = False
    rig: str | None = None
    title: str = ""
    detail: str = ""
    left: str = ""
    """how long still"""
    fraction: float = 0.0
    """of the plan, 0 to 1"""
    note: str = ""
    rig_state: str = "good"
    rig_words: str = NO_SESSION.short
    onlookers: str = ""
    alarms: list[str]
    """a line for each rig"""


@router.get("/run-state")
def run_state(request: Request, user: access.Viewer) -> RunState:
    """Whether a rig moves, how long still, who operates it and who watches, and what a person must do at once; asked for by
    every page once a second."""
    service = access.service_of(request)
    for rig in service.rigs.files():
        service.operators.watch(rig, user)
    alarms = alarm_lines(service)
    active = service.sessions.under_way()
    if active is None:
        homing = service.homings.under_way()
        return (
            RunState(alarms=alarms) if homing is None else _homing_state(service, homing, user.name, alarms)
        )
    progress = active.payload_session.progress
    state = STATES[active.state]
    left = seconds_left(progress)
    return RunState(
        running=True,
        rig=active.rig,
        title=state.long,
        detail=f"{active.experiment_name}, {active.id}, by {active.user}",
        left="" if left is None else f"{duration(left)} left",
        fraction=progress.fraction,
        note="Stops the motion at once, without confirmation. Everything measured is kept.",
        rig_state=state.kind,
        rig_words=state.short,
        onlookers=onlooker_words(service, active.rig, user.name),
        alarms=alarms,
    )


def alarm_lines(service: Service) -> list[str]:
    """What a person must do at once, a line for each rig."""
    return [f"{rig}: {alarm}" for rig, alarm in sorted(service.sessions.alarms().items())]


def _homing_state(service: Service, homing: HomingRun, own_name: str, alarms: list[str]) -> RunState:
    return RunState(
        running=True,
        rig=homing.rig,
        title=f"{homing.joint} is being homed",
        detail=f"{homing.rig}, by {homing.operator}",
        note="Stops the motion at once, without confirmation.",
        rig_state="warn",
        rig_words="Homing",
        onlookers=onlooker_words(service, homing.rig, own_name),
        alarms=alarms,
    )


@router.post("/stop")
async def stop(request: Request, user: access.SignedIn) -> Context:
    """Bring everything to rest, now. Open to everybody who is signed in."""
    return everything_stopped(access.service_of(request).rig_stop, user.name)


def seconds_left(progress: Any) -> float | None:
    """s that the plan still takes, from the share that is done; None before the first cycle."""
    if not progress.fraction:
        return None
    return progress.elapsed * (1.0 - progress.fraction) / progress.fraction
