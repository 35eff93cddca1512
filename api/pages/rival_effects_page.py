"""What these data cannot tell apart, and the experiment that would: found by itself, planned by one press."""

from typing import Annotated
from urllib.parse import urlencode

from fastapi import APIRouter, Query, Request
from fastapi.responses import HTMLResponse, Response

from api.pages.choices import JointChoice
from api.pages.evidence_view import joint_diagnosis
from api.pages.form_input import input_errors_as_problems
from api.pages.job_views import job_progress
from api.pages.layout import experiment_link, frame
from api.pages.rendering import PREFIX, page
from api.pages.rival_effects import rival_effects_context
from api.pages.stored_models import StoredExperiment
from api.service import access
from api.service.accounts import User
from api.service.searches_aside import FIT_AGAIN

router = APIRouter(prefix=f"{PREFIX}/experiments/{{experiment}}/missing", include_in_schema=False)


JobChoice = Annotated[str | None, Query(max_length=32)]
ProposalChoice = Annotated[int, Query(ge=1, le=20)]


@router.post("/apart")
def find(request: Request, user: access.Operator, experiment: str, joint: JointChoice = None) -> HTMLResponse:
    """Look for the experiment that tells the rivals of a joint apart.

    The page asks by itself: while something else is computed nothing is begun, and the page that comes with it asks again.
    """
    service = access.service_of(request)
    joint = StoredExperiment(service.experiments, experiment).joint_or_first(joint)
    job = next((each for each in service.jobs.unfinished(experiment) if each.kind != FIT_AGAIN), None)
    if job is None:
        job = service.models.separate(experiment, user.name, joint)
    return _answer(request, user, experiment, joint, job.id if job.kind == "separate" else None)


@router.get("/apart")
def follow(
    request: Request, user: access.Viewer, experiment: str, joint: JointChoice = None, job: JobChoice = None
) -> HTMLResponse:
    """The part of the page, with the progress of that job while it runs."""
    return _answer(request, user, experiment, joint, job)


@router.post("/apart/plan")
def plan(
    request: Request,
    user: access.Operator,
    experiment: str,
    joint: JointChoice = None,
    proposal: ProposalChoice = 1,
) -> Response:
    """Make the plan of a proposed experiment, and go on to the new session with it."""
    service = access.service_of(request)
    stored = StoredExperiment(service.experiments, experiment)
    joint = stored.joint_or_first(joint)
    with input_errors_as_problems():
        made = service.separating.plan(experiment, joint, proposal)
    query = {"rig": made.rig, "experiment": experiment, "payload": made.payload, "plan": made.plan}
    return Response(status_code=204, headers={"HX-Redirect": f"{PREFIX}/new-session?{urlencode(query)}"})


def _answer(
    request: Request, user: User, experiment: str, joint: str | None, job: str | None
) -> HTMLResponse:
    service = access.service_of(request)
    stored = StoredExperiment(service.experiments, experiment)
    joint = stored.joint_or_first(joint)
    shown = stored.require_current()
    diagnosis = joint_diagnosis(stored, shown, joint)
    context = rival_effects_context(stored, shown, diagnosis, joint) | {"begin": False}
    known = service.jobs.get(job) if job else None
    if known is not None and not known.state.final:
        query = urlencode({"joint": joint, "job": known.id})
        poll = f"{experiment_link(experiment, 'missing/apart')}?{query}"
        context |= {"progress": job_progress(known) | {"poll_link": poll}}
    elif known is not None and known.state != "done":
        context |= {"failed": known.words}
    return page(
        request,
        "rival_effects.html",
        **frame(request, user, "missing", experiment),
        apart=context,
        running=None,
    )
