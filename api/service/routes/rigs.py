"""Rigs: what they are, who has them, and the stop."""

import json
from typing import Annotated

from fastapi import APIRouter, Path, Request
from pydantic import Field

from api.service import access, text_forms
from api.service.access import client_address, service_of
from api.service.accounts import Role
from api.service.openapi import ResourceRoute, problems
from api.service.problems import Problem, not_found
from api.service.request_document import RequestDocument
from api.service.rig_documents import HomingView, ResetJointView, RigSummary, RigView, Stopped

router = APIRouter(tags=["rigs"], route_class=ResourceRoute)

RigId = Annotated[str, Path(pattern=text_forms.NAME)]


class HandOver(RequestDocument):
    """To whom the rig goes."""

    to: Annotated[str, Field(pattern=text_forms.USER_NAME, examples=["grace"])]


class HomingOrder(RequestDocument):
    """Which joint is to be homed, and how."""

    joint: str = Field(examples=["j3"])
    method: Annotated[int, Field(ge=-128, le=127)] | None = Field(
        default=None,
        description="homing method 0x6098 (37: here is home, without motion); left out, the drive's own",
        examples=[37],
    )
    reset_faults: bool = Field(default=False, description="reset the drives' faults first", examples=[False])


def _summary(request: Request, rig: str) -> RigSummary:
    service = service_of(request)
    try:
        settings, problem = service.rigs.rig(rig), None
    except Problem:
        raise
    except Exception as error:
        settings, problem = None, str(error)
    return RigSummary(
        id=rig,
        name=settings.name if settings else None,
        description=settings.description if settings else None,
        simulated=bool(settings and settings.simulated is not None),
        problem=problem,
        operator=service.operators.operator(rig),
        onlookers=service.operators.onlookers(rig),
    )


def _known(request: Request, rig: str) -> str:
    if rig not in service_of(request).rigs.files():
        raise not_found("rig", rig)
    return rig


@router.get("/rigs")
def list_rigs(request: Request, _user: access.Viewer) -> list[RigSummary]:
    """All rigs, and who is at them."""
    return [_summary(request, rig) for rig in service_of(request).rigs.files()]


@router.get("/rigs/{rig}")
def get_rig(request: Request, user: access.Viewer, rig: RigId) -> RigView:
    """One rig: its settings, its operator, who watches it, and the session under way."""
    service = service_of(request)
    settings = service.rigs.rig(rig)
    service.operators.watch(rig, user)
    return RigView(
        **dict(_summary(request, rig)),
        settings=json.loads(service.settings.without_folders(settings.model_dump_json())),
        drive_gain=settings.drive_gain.tolist(),
        status=service.live.status(rig),
    )


@router.post("/rigs/{rig}/take", responses=problems(409))
def take(request: Request, user: access.Operator, rig: RigId) -> RigSummary:
    """Have the rig: only one operator does at a time."""
    service = service_of(request)
    service.operators.take(_known(request, rig), user)
    service.live.tell(rig)
    return _summary(request, rig)


@router.post("/rigs/{rig}/release", responses=problems(409))
def release(request: Request, user: access.Operator, rig: RigId) -> RigSummary:
    """Give the rig back."""
    service = service_of(request)
    service.operators.release(_known(request, rig), user)
    service.live.tell(rig)
    return _summary(request, rig)


@router.post("/rigs/{rig}/hand-over", responses=problems(409))
def hand_over(request: Request, user: access.Operator, rig: RigId, change: HandOver) -> RigSummary:
    """Give the rig to another operator."""
    service = service_of(request)
    _known(request, rig)
    receiver = next((row for row in service.accounts.users() if row.name == change.to), None)
    if receiver is None or not Role(receiver.role).covers(Role.OPERATOR):
        raise Problem(409, f"{change.to} is not an operator of this service.")
    service.operators.hand_over(rig, user, change.to)
    service.live.tell(rig)
    return _summary(request, rig)


@router.post("/rigs/{rig}/homing", status_code=202, responses=problems(409, 503))
def home(request: Request, user: access.Operator, rig: RigId, order: HomingOrder) -> HomingView:
    """Home one joint: its drive moves the axis by itself, and no limit of the rig file watches it.

    Returns at once; ask how it goes, and stop it as any motion with `POST /rigs/{rig}/stop`.
    """
    homings = service_of(request).homings
    return HomingView.model_validate(
        homings.start(
            _known(request, rig),
            user,
            joint=order.joint,
            method=order.method,
            reset_faults=order.reset_faults,
            client=client_address(request),
        )
    )


@router.get("/rigs/{rig}/homing")
def get_homing(request: Request, _user: access.Viewer, rig: RigId) -> HomingView | None:
    """The homing under way on this rig, or the last one; null if there was none since the service started."""
    run = service_of(request).homings.run(_known(request, rig))
    return None if run is None else HomingView.model_validate(run)


@router.post("/rigs/{rig}/reset", responses=problems(409, 503))
def reset(request: Request, user: access.Operator, rig: RigId) -> list[ResetJointView]:
    """Reset the faults of the rig's drives, and take the power of those that have some. No axis is moved, no zero changed.

    An axis without a brake sinks when its power goes.
    """
    joints = service_of(request).drive_resets.reset(_known(request, rig), user, client_address(request))
    return [ResetJointView.model_validate(joint) for joint in joints]


@router.post("/rigs/{rig}/stop")
async def stop(request: Request, user: access.SignedIn, rig: RigId) -> Stopped:
    """Bring the rig to rest, now. Open to everybody who is signed in, always; harmless when repeated."""
    # What moves is answered before any route, by `StopRequests`; what comes here is mostly a rig that nothing has used.
    stopped = service_of(request).rig_stop.stop(rig, user.name)
    if stopped is None:
        _known(request, rig)
    return Stopped(stopped=bool(stopped))
