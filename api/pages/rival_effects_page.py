"""What these data cannot tell apart, and the experiment that would: found by itself, planned by one press."""

from collections.abc import Mapping
from math import floor, log10
from typing import Annotated, Any
from urllib.parse import urlencode

from fastapi import APIRouter, Query, Request
from fastapi.responses import HTMLResponse, Response

from api.pages.account_pages import said_in_words
from api.pages.catalogue_words import effect_titles
from api.pages.error_figures import JointUnits
from api.pages.evidence_view import joint_diagnosis
from api.pages.job_views import job_progress
from api.pages.layout import experiment_link, frame
from api.pages.model_page import JointChoice
from api.pages.number_format import THIN, number, significant
from api.pages.rendering import PREFIX, page
from api.pages.stored_models import ShownModel, StoredExperiment
from api.pages.verdict_words import rival_words
from api.service import access
from api.service.accounts import User

router = APIRouter(prefix=f"{PREFIX}/experiments/{{experiment}}/missing", include_in_schema=False)

HELPS = 1.0
"""Standard deviations of the noise below which an experiment is not worth running."""

JobChoice = Annotated[str | None, Query(max_length=32)]
ProposalChoice = Annotated[int, Query(ge=1, le=20)]


@router.post("/apart")
def find(request: Request, user: access.Operator, experiment: str, joint: JointChoice = None) -> HTMLResponse:
    """Look for the experiment that tells the rivals of a joint apart.

    The page asks by itself: while something else is computed nothing is begun, and the page that comes with it asks again.
    """
    service = access.service_of(request)
    joint = StoredExperiment(service.experiments, experiment).joint_or_first(joint)
    job = service.jobs.active(experiment)
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
    with said_in_words():
        made = service.separating.plan(experiment, joint, proposal)
    query = {"rig": made.rig, "experiment": experiment, "payload": made.payload, "plan": made.plan}
    return Response(status_code=204, headers={"HX-Redirect": f"{PREFIX}/new-session?{urlencode(query)}"})


def _answer(
    request: Request, user: User, experiment: str, joint: str | None, job: str | None
) -> HTMLResponse:
    service = access.service_of(request)
    stored = StoredExperiment(service.experiments, experiment)
    joint = stored.joint_or_first(joint)
    shown = stored.standing()
    diagnosis = joint_diagnosis(stored, shown, joint)
    context = rival_effects_context(stored, shown, diagnosis, joint) | {"begin": False}
    found = service.jobs.get(job) if job else None
    if found is not None and not found.state.final:
        query = urlencode({"joint": joint, "job": found.id})
        poll = f"{experiment_link(experiment, 'missing/apart')}?{query}"
        context |= {"progress": job_progress(found) | {"poll_link": poll}}
    elif found is not None and found.state != "done":
        context |= {"failed": found.words}
    return page(
        request,
        "rival_effects.html",
        **frame(request, user, "missing", experiment),
        apart=context,
        running=None,
    )


def rival_effects_context(
    stored: StoredExperiment, shown: ShownModel, diagnosis: Mapping[str, Any] | None, joint: str
) -> dict[str, Any]:
    """What the panel shows: the rivals in words, and the experiment that was found, or where to ask for it."""
    index = stored.joint_names.index(joint)
    rivals = rival_words(diagnosis["candidates"], effect_titles(), diagnosis["missing"]) if diagnosis else []
    found = stored.models.next_experiment(shown.version.id, index) if rivals else None
    link = experiment_link(stored.id, "missing/apart")
    units = JointUnits.of(stored.declared.robot.joints[index].type)
    proposals = _worth_running(found, units)
    for row in proposals:
        row["plan_link"] = f"{link}/plan?{urlencode({'joint': joint, 'proposal': row['rank']})}"
    return {
        "rivals": rivals,
        "found": found,
        "proposals": proposals,
        "decides": bool(proposals and proposals[0]["decides"]),
        "find_link": f"{link}?{urlencode({'joint': joint})}",
        "progress": None,
        "failed": None,
        "begin": True,
    }


def _worth_running(found: Mapping[str, Any] | None, units: JointUnits) -> list[dict[str, Any]]:
    """The proposals with their figures in words; none where no motion separates the rivals."""
    rows = []
    for rank, proposal in enumerate((found or {}).get("proposals", []), start=1):
        if (proposal["separation"] or 0.0) < HELPS:
            break  # the best come first
        low, high = proposal["position_from"], proposal["position_to"]
        decimals = max(0, 2 - floor(log10(high - low)))
        words = {
            "rank": rank,
            "speed_words": f"{significant(proposal['speed'])}{THIN}{units.speed}",
            "range_words": f"{number(low, decimals)} and {number(high, decimals)}{THIN}{units.position}",
        }
        rows.append(dict(proposal) | words)
    return rows
