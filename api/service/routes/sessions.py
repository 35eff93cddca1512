"""Payload sessions: create, check, weigh, confirm, arm, start, stop, recover."""

from typing import Annotated, Literal

from fastapi import APIRouter, Request, Response
from pydantic import Field

from api.service import access, text_forms
from api.service.access import client_address, service_of
from api.service.database import SessionRow
from api.service.job_documents import JobView
from api.service.openapi import ResourceRoute, problems
from api.service.problems import Problem
from api.service.request_document import RequestDocument
from api.service.rig_documents import Stopped
from api.service.routes.experiments import ExperimentId, SessionId, session_summary
from api.service.session_documents import ChangedSession, RigCheckView, SessionSummary, TypedPayload
from identify.recording.experiment_file import Payload

router = APIRouter(tags=["sessions"], route_class=ResourceRoute)


class NewSession(RequestDocument):
    """A payload session to be prepared."""

    rig: Annotated[str, Field(pattern=text_forms.NAME, examples=["rx130l-joint3-simulated"])]
    plan: Annotated[str, Field(pattern=text_forms.SMALL_ID, examples=["joint3-sinusoids"])]
    payload: TypedPayload
    role: Literal["identification", "validation"] = "identification"


class Weighing(RequestDocument):
    """What the scale says, typed by the operator; without a mass the scale on the serial port is asked."""

    mass: Annotated[
        float | None, Field(ge=0, le=1e5, allow_inf_nan=False, description="kg", examples=[3.4584])
    ] = None


class SessionChange(RequestDocument):
    """What is to be changed of a measured session; what is left out stays."""

    excluded: Annotated[
        str | None,
        Field(
            max_length=500,
            description="why no model is to use it; null includes it again",
            examples=["the payload was loose"],
        ),
    ] = None
    role: Annotated[
        Literal["identification", "validation"] | None,
        Field(description="fit models to it, or only check them on it", examples=[None]),
    ] = None
    note: Annotated[str | None, Field(max_length=2000, examples=["second try, colder"])] = None


@router.post("/experiments/{experiment}/sessions", status_code=201, responses=problems(409, 507))
def create_session(
    request: Request, response: Response, user: access.Operator, experiment: ExperimentId, new: NewSession
) -> SessionSummary:
    """Prepare a payload session. Whoever does it has the rig from then on."""
    service = service_of(request)
    service.disk.require_room()
    if new.payload.mass is None:
        payload = service.rigs.rig(new.rig).payload(new.payload.name)
    else:
        given = new.payload.model_dump(exclude_none=True)
        payload = Payload.model_validate(given)
    row = service.sessions.create(
        experiment, user, rig=new.rig, plan=new.plan, payload=payload, role=new.role
    )
    service.live.tell(new.rig)
    response.headers["Location"] = f"/experiments/{experiment}/sessions/{row.id}"
    return _summary(request, row)


@router.get("/experiments/{experiment}/sessions")
def list_sessions(request: Request, _user: access.Viewer, experiment: ExperimentId) -> list[SessionSummary]:
    """The sessions of an experiment, measured or being prepared."""
    return [session_summary(entry) for entry in service_of(request).catalogue.entries(experiment)]


@router.get("/experiments/{experiment}/sessions/{session}")
def get_session(
    request: Request, _user: access.Viewer, experiment: ExperimentId, session: SessionId
) -> SessionSummary:
    """One session."""
    return session_summary(service_of(request).catalogue.entry(experiment, session))


@router.patch("/experiments/{experiment}/sessions/{session}", responses=problems(409))
def change_session(
    request: Request,
    user: access.Operator,
    experiment: ExperimentId,
    session: SessionId,
    change: SessionChange,
) -> ChangedSession:
    """Exclude a measured session from all models or include it again, change its role, or write a note. Models are fitted
    again where the data have changed; the reason of an exclusion is kept with the data."""
    catalogue = service_of(request).catalogue
    given = change.model_fields_set
    included = False if "excluded" in given else None
    job = catalogue.change(
        experiment,
        session,
        user.name,
        role=change.role,
        excluded=included if change.excluded is None else change.excluded,
        note=(change.note or "") if "note" in given else None,
    )
    entry = catalogue.entry(experiment, session)
    return ChangedSession(session=session_summary(entry), job=JobView.model_validate(job) if job else None)


@router.delete("/experiments/{experiment}/sessions/{session}", status_code=204, responses=problems(409))
def discard_session(
    request: Request, user: access.Operator, experiment: ExperimentId, session: SessionId
) -> None:
    """Forget a session that was not measured. Nothing that was measured can be deleted here."""
    service_of(request).sessions.discard(experiment, session, user)


@router.post("/experiments/{experiment}/sessions/{session}/check", responses=problems(409, 503))
def check(
    request: Request, user: access.Operator, experiment: ExperimentId, session: SessionId
) -> RigCheckView:
    """Take the rig's bus and check nodes, homing and limits. Nothing is powered."""
    return RigCheckView.model_validate(service_of(request).sessions.check(experiment, session, user))


@router.post("/experiments/{experiment}/sessions/{session}/weigh", responses=problems(409, 503))
def weigh(
    request: Request, user: access.Operator, experiment: ExperimentId, session: SessionId, weighing: Weighing
) -> SessionSummary:
    """Note what the payload weighs, as typed or from the scale."""
    service = service_of(request)
    typed = weighing.mass

    def mass() -> float:
        return typed if typed is not None else service.scale.weigh()

    return _summary(request, service.sessions.weigh(experiment, session, user, mass))


@router.post("/experiments/{experiment}/sessions/{session}/confirm", responses=problems(409))
def confirm(
    request: Request, user: access.Operator, experiment: ExperimentId, session: SessionId
) -> SessionSummary:
    """Confirm that this payload is mounted. The weighed mass must be the payload's."""
    return _summary(request, service_of(request).sessions.confirm(experiment, session, user))


@router.post("/experiments/{experiment}/sessions/{session}/arm", responses=problems(409, 503))
def arm(
    request: Request, user: access.Operator, experiment: ExperimentId, session: SessionId
) -> SessionSummary:
    """Start recorder and monitors; the next step moves the robot."""
    sessions = service_of(request).sessions
    return _summary(request, sessions.arm(experiment, session, user, client_address(request)))


@router.post("/experiments/{experiment}/sessions/{session}/start", responses=problems(409, 503))
def start(
    request: Request, user: access.Operator, experiment: ExperimentId, session: SessionId
) -> SessionSummary:
    """Move the robot."""
    sessions = service_of(request).sessions
    return _summary(request, sessions.start(experiment, session, user, client_address(request)))


@router.post("/experiments/{experiment}/sessions/{session}/stop", responses=problems(409))
async def stop(
    request: Request, user: access.SignedIn, experiment: ExperimentId, session: SessionId
) -> Stopped:
    """Bring the session's rig to rest, now. Open to everybody who is signed in, always."""
    stopped = service_of(request).rig_stop.stop_session(experiment, session, user.name)
    if stopped is None:
        raise Problem(409, f"The session {session} of {experiment} has no rig's bus: nothing moves.")
    return Stopped(stopped=stopped)


@router.post("/experiments/{experiment}/sessions/{session}/recover", responses=problems(409))
def recover(
    request: Request, user: access.Operator, experiment: ExperimentId, session: SessionId
) -> SessionSummary:
    """Finish a recording whose process died: what was measured until then becomes a session's file."""
    return _summary(request, service_of(request).unlisted_recordings.recover(experiment, session, user))


@router.post("/experiments/{experiment}/sessions/{session}/admit", responses=problems(409))
def admit(
    request: Request, user: access.Operator, experiment: ExperimentId, session: SessionId
) -> SessionSummary:
    """Use a session that a limit, a fault or somebody ended, after a look at it; all sessions are identified anew."""
    return _summary(request, service_of(request).unlisted_recordings.admit(experiment, session, user))


def _summary(request: Request, row: SessionRow) -> SessionSummary:
    """The session of an index row as the catalogue knows it."""
    return session_summary(service_of(request).catalogue.entry(row.experiment, row.id))
