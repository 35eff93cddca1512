"""Proofs on the drive: a plan without and with the model's feedforward torque, and what that did to the following error."""

from typing import Annotated, Literal

from fastapi import APIRouter, Path, Request, Response
from pydantic import Field

from api.proof_drive import Drive
from api.service import access, text_forms
from api.service.access import service_of
from api.service.database import SessionRow
from api.service.job_documents import JobView
from api.service.openapi import ResourceRoute, problems
from api.service.proof_documents import ProofView, UnfinishedRunView
from api.service.proofs import ProofState
from api.service.request_document import RequestDocument
from api.service.routes.experiments import ExperimentId, session_summary
from api.service.routes.jobs import accepted
from api.service.session_documents import SessionSummary

router = APIRouter(tags=["proofs"], route_class=ResourceRoute)

ProofNumber = Annotated[str, Path(pattern=text_forms.NUMBER)]


class NewProof(RequestDocument):
    """What is to be proved, and on what."""

    rig: Annotated[str, Field(pattern=text_forms.NAME, examples=["rx130l-joint3-simulated"])]
    plan: Annotated[str, Field(pattern=text_forms.SMALL_ID, examples=["joint3-sinusoids"])]
    payload: Annotated[
        str, Field(max_length=64, description="of the experiment or the rig", examples=["disk-3.5"])
    ]
    model: Annotated[
        str | None,
        Field(
            pattern=text_forms.MODEL_NUMBER,
            description="a version; null for the current one",
            examples=["m2"],
        ),
    ] = None
    part: Literal["whole", "friction"] = Field(
        default="whole", description="all of the model, or what it has beside the rigid robot"
    )
    share: Annotated[
        float,
        Field(
            gt=0,
            le=1,
            strict=True,
            description="of each current limit: no more than that is sent",
            examples=[0.6],
        ),
    ] = 0.6


def _view(request: Request, experiment: str, state: ProofState) -> ProofView:
    settings = state.settings
    return ProofView(
        proof=state.number,
        model=settings.version,
        effects=[settings.model, *settings.add],
        rig=settings.rig,
        plan=settings.plan,
        payload=settings.payload.name,
        part=settings.part,
        share=settings.share,
        operator=settings.operator,
        created=settings.created,
        next=state.next,
        unfinished=_unfinished(state),
        without=_summary(request, experiment, state.without),
        with_torque=_summary(request, experiment, state.with_),
        result=state.result,
    )


def _unfinished(state: ProofState) -> UnfinishedRunView | None:
    run = state.unfinished
    if run is None:
        return None
    return UnfinishedRunView(drive=run.drive, recording=run.recording, seconds=run.seconds, words=run.words)


def _summary(request: Request, experiment: str, row: SessionRow | None) -> SessionSummary | None:
    return None if row is None else session_summary(service_of(request).catalogue.entry(experiment, row.id))


@router.post("/experiments/{experiment}/proofs", status_code=202, responses=problems(409, 507))
def prepare_proof(
    request: Request, response: Response, user: access.Operator, experiment: ExperimentId, new: NewProof
) -> JobView:
    """Compute the model's torque along a plan (a job whose result is {"proof": number}); nothing moves. A model that may do
    harm is refused by the job, in its words."""
    service = service_of(request)
    service.disk.require_room()
    job = service.proofs.prepare(
        experiment,
        user,
        rig=new.rig,
        plan=new.plan,
        payload=new.payload,
        model=new.model,
        part=new.part,
        share=new.share,
    )
    return accepted(job, response)


@router.get("/experiments/{experiment}/proofs")
def list_proofs(request: Request, _user: access.Viewer, experiment: ExperimentId) -> list[ProofView]:
    """All proofs of an experiment, the newest first."""
    return [_view(request, experiment, each) for each in service_of(request).proofs.all(experiment)]


@router.get("/experiments/{experiment}/proofs/{proof}")
def get_proof(
    request: Request, _user: access.Viewer, experiment: ExperimentId, proof: ProofNumber
) -> ProofView:
    """One proof: what is sent, its two drives, and what came of them."""
    return _view(request, experiment, service_of(request).proofs.get(experiment, proof))


@router.post(
    "/experiments/{experiment}/proofs/{proof}/drives/{drive}", status_code=201, responses=problems(409, 507)
)
def prepare_drive(
    request: Request,
    response: Response,
    user: access.Operator,
    experiment: ExperimentId,
    proof: ProofNumber,
    drive: Drive,
) -> SessionSummary:
    """Prepare one of the two drives; it is checked, weighed, confirmed, armed and started by the steps of every session. Whoever
    does it has the rig from then on."""
    service = service_of(request)
    service.disk.require_room()
    row = service.proofs.prepare_drive(experiment, proof, drive, user)
    service.live.tell(row.rig or "")
    response.headers["Location"] = f"/experiments/{experiment}/sessions/{row.id}"
    return session_summary(service.catalogue.entry(experiment, row.id))
