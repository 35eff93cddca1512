"""Live: what the robot does now, readable from two metres."""

from fastapi import APIRouter, Request
from fastapi.responses import HTMLResponse

from api.pages.choices import RigChoice, chosen_rig
from api.pages.error_figures import JointUnits
from api.pages.layout import frame
from api.pages.rendering import PREFIX, page
from api.service import access
from api.service.problems import Problem
from identify.recording.errors import InputError

router = APIRouter(prefix=PREFIX, include_in_schema=False)


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
    axes = [
        {
            "joint": axis.joint,
            "units": JointUnits.of(settings.robot.joints[index].type),
            "current_limit": axis.limits.current,
            "following_limit": axis.limits.following_error,
            "low": axis.limits.position[0],
            "high": axis.limits.position[1],
        }
        for index, axis in enumerate(settings.axes)
    ]
    active = service.sessions.active(rig_id)
    return page(
        request,
        "live.html",
        **frame(request, user, "live"),
        rig_id=rig_id,
        axes=axes,
        cycle=settings.cycle,
        active=active,
    )
