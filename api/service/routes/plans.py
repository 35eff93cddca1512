"""Excitation plans."""

from typing import Annotated

import numpy as np
from fastapi import APIRouter, Path, Query, Request, Response
from pydantic import Field

from api.service import access, text_forms
from api.service.access import service_of
from api.service.job_documents import JobView
from api.service.openapi import ResourceRoute, problems
from api.service.plan_documents import PlanPreview, PlanSummary, PlanView
from api.service.problems import Problem, not_found
from api.service.request_document import RequestDocument
from api.service.routes.jobs import accepted
from daq.excitation.excitation_plan import ExcitationPlan
from identify.recording.plain_text import Printable

router = APIRouter(tags=["plans"], route_class=ResourceRoute)

PlanId = Annotated[str, Path(pattern=text_forms.SMALL_ID)]


class PlanRequest(RequestDocument):
    """A plan to be made within a rig's limits."""

    rig: Annotated[str, Field(pattern=text_forms.NAME, examples=["rx130l-joint3-simulated"])]
    name: Annotated[Printable, Field(min_length=1, max_length=64, examples=["joint3 sinusoids"])]
    seconds: Annotated[float, Field(gt=0, le=3600, examples=[60.0])] = 60.0
    model: Annotated[
        str, Field(max_length=200, pattern=text_forms.PLANNED_MODEL, examples=["load-velocity"])
    ] = "load-velocity"
    seed: Annotated[int, Field(ge=0, le=2**31, examples=[0])] = 0
    experiment: Annotated[
        str | None,
        Field(
            max_length=64,
            description="predict loads and currents with its current model; else masses are assumed",
            examples=["rx130l-joint3"],
        ),
    ] = None


def _summary(identifier: str, plan: ExcitationPlan) -> PlanSummary:
    return PlanSummary(
        id=identifier,
        name=plan.name,
        rig=plan.rig,
        model=plan.model,
        joints=list(plan.joints),
        duration=plan.duration,
    )


@router.get("/plans")
def list_plans(request: Request, _user: access.Viewer) -> list[PlanSummary]:
    """All plans, the newest first."""
    plans = service_of(request).plans
    return [_summary(each, plans.plan(each)) for each in plans.ids()]


@router.post("/plans", status_code=202, responses=problems(404, 409))
def make_plan(request: Request, response: Response, user: access.Operator, wanted: PlanRequest) -> JobView:
    """Plan an excitation for a model within a rig's limits; the job's result names the plan."""
    service = service_of(request)
    identified = None
    if wanted.experiment is not None:
        identified = service.models.results(wanted.experiment).identification
        if identified is None:
            raise Problem(409, f"The experiment {wanted.experiment} has no model yet.")
    job = service.planner.plan(
        wanted.rig, user.name, wanted.name, wanted.seconds, wanted.model, wanted.seed, identified
    )
    return accepted(job, response)


@router.get("/plans/{plan}")
def get_plan(request: Request, _user: access.Viewer, plan: PlanId) -> PlanView:
    """One plan with its phases in closed form."""
    stored = service_of(request).plans.plan(plan)
    return PlanView(
        **dict(_summary(plan, stored)),
        start=list(stored.start),
        phases=list(stored.phases),
        report=service_of(request).plans.report(plan),
    )


@router.get("/plans/{plan}/preview")
def preview(
    request: Request,
    _user: access.Viewer,
    plan: PlanId,
    points: Annotated[int, Query(ge=2, le=5000)] = 1000,
) -> PlanPreview:
    """Position, velocity and acceleration over time, and the limits of the plan's rig that it breaks."""
    from daq.excitation.plan_limits import violations

    service = service_of(request)
    stored = service.plans.plan(plan)
    if stored.rig not in service.rigs.files():
        raise not_found("rig", stored.rig)
    time = np.linspace(0.0, stored.duration, points)
    setpoints = stored.setpoints(time)
    return PlanPreview(
        time=time.tolist(),
        position=setpoints.position.T.tolist(),
        velocity=setpoints.velocity.T.tolist(),
        acceleration=setpoints.acceleration.T.tolist(),
        violations=[str(each) for each in violations(stored, service.rigs.rig(stored.rig))],
    )
