"""What a model misses, and the catalogue of effects."""

from typing import Annotated

from fastapi import APIRouter, Query, Request, Response
from pydantic import Field

from api.service import access, text_forms
from api.service.access import service_of
from api.service.job_documents import JobView
from api.service.openapi import ResourceRoute, problems
from api.service.plan_documents import MadePlanView
from api.service.problems import Problem
from api.service.request_document import RequestDocument
from api.service.routes.experiments import ExperimentId
from api.service.routes.jobs import accepted
from api.service.routes.models import JointName, ModelId
from identify.results.diagnosis import DiagnosisDocument
from identify.results.effect import CatalogueEffect
from identify.results.next_experiment import NextExperimentDocument

router = APIRouter(tags=["diagnoses"], route_class=ResourceRoute)


JudgeMotion = Annotated[
    bool,
    Query(
        description="also predict motion a second ahead where the fit did not see, and say of each effect whether that gets worse"
    ),
]


class OfJoint(RequestDocument):
    """Which joint is meant."""

    joint: JointName


class ProposalChoice(OfJoint):
    """A proposed experiment, and the rig that is to run it."""

    proposal: Annotated[int, Field(ge=1, le=20, description="its place in the list", examples=[1])] = 1
    rig: Annotated[
        str | None,
        Field(
            pattern=text_forms.NAME,
            description="the rig that measured the experiment last if not said",
            examples=["rx130l-joint3-simulated"],
        ),
    ] = None


@router.get("/effects")
def effects(_user: access.Viewer) -> list[CatalogueEffect]:
    """The catalogue of physical effects."""
    import identify  # SciPy behind it takes a moment; only the first call waits

    return identify.catalogue()


@router.post("/experiments/{experiment}/models/{model}/diagnosis", status_code=202, responses=problems(409))
def diagnose(
    request: Request,
    response: Response,
    user: access.Operator,
    experiment: ExperimentId,
    model: ModelId,
    motion: JudgeMotion = False,
) -> JobView:
    """Find where that model fails and which physical effect is missing."""
    job = service_of(request).models.diagnose(experiment, user.name, model, motion)
    return accepted(job, response)


@router.get("/experiments/{experiment}/models/{model}/diagnosis")
def get_diagnosis(
    request: Request, _user: access.Viewer, experiment: ExperimentId, model: ModelId
) -> DiagnosisDocument:
    """What was found to be missing in that model: the document of `coulomb diagnose --json`."""
    document = service_of(request).models.story(experiment).diagnosis(model)
    if document is None:
        raise Problem(404, f"The model {model} was not diagnosed yet: POST to this address.")
    return document


@router.post(
    "/experiments/{experiment}/models/{model}/next-experiment",
    status_code=202,
    responses=problems(409),
)
def find_next_experiment(
    request: Request,
    response: Response,
    user: access.Operator,
    experiment: ExperimentId,
    model: ModelId,
    wanted: OfJoint,
) -> JobView:
    """Find the experiment that tells apart what the model's diagnosis left open on one joint."""
    job = service_of(request).models.separate(experiment, user.name, wanted.joint, model)
    return accepted(job, response)


@router.get("/experiments/{experiment}/models/{model}/next-experiment")
def get_next_experiment(
    request: Request,
    _user: access.Viewer,
    experiment: ExperimentId,
    model: ModelId,
    joint: Annotated[str, Query(max_length=64, min_length=1, examples=["j3"])],
) -> NextExperimentDocument:
    """The experiment that would tell the rivals of a joint apart: the document of `coulomb next --json`."""
    service = service_of(request)
    joints = service.experiments.row(experiment).joints
    story = service.models.story(experiment)
    story.read().version(model)
    document = story.next_experiment(model, joints.index(joint)) if joint in joints else None
    if document is None:
        raise Problem(404, f"No experiment was looked for yet on joint {joint}: POST to this address.")
    return document


@router.post(
    "/experiments/{experiment}/models/{model}/next-experiment/plan", status_code=201, responses=problems(409)
)
def plan_next_experiment(
    request: Request,
    response: Response,
    _user: access.Operator,
    experiment: ExperimentId,
    model: ModelId,
    wanted: ProposalChoice,
) -> MadePlanView:
    """Plan a proposed experiment within a rig's limits. A session takes the plan and the payload from here."""
    made = service_of(request).separating.plan(experiment, wanted.joint, wanted.proposal, wanted.rig, model)
    response.headers["Location"] = f"/plans/{made.plan}"
    return MadePlanView(plan=made.plan, rig=made.rig, payload=made.payload, remarks=list(made.remarks))


@router.post("/experiments/{experiment}/improvement", status_code=202, responses=problems(409))
def improve(
    request: Request,
    response: Response,
    user: access.Operator,
    experiment: ExperimentId,
    motion: JudgeMotion = False,
) -> JobView:
    """Diagnose and add, step by step, until nothing more is justified; every step becomes a model version."""
    job = service_of(request).models.improve(experiment, user.name, motion)
    return accepted(job, response)
