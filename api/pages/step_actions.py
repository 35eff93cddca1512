"""The steps of the model from the page: diagnose, add, remove, undo, redo; each answers with the exchanged part."""

from typing import Annotated

from fastapi import APIRouter, Query, Request
from fastapi.responses import HTMLResponse, Response

from api.pages.choices import EffectChoice, JointChoice
from api.pages.experiment_frame import experiment_context
from api.pages.job_views import BESIDE, failed_fit, fit_key, job_context, job_state, news_context
from api.pages.layout import frame
from api.pages.missing_body import body_context
from api.pages.rendering import PREFIX, page
from api.pages.stored_models import StoredExperiment
from api.service import access
from api.service.accounts import User
from api.service.jobs import Job
from api.service.model_workflow import ModelWorkflow
from api.service.problems import Problem
from api.service.searches_aside import FIT_AGAIN

router = APIRouter(prefix=f"{PREFIX}/experiments/{{experiment}}", include_in_schema=False)


@router.post("/steps/fit")
def fit(request: Request, user: access.Operator, experiment: str) -> Response:
    """Identify sessions that no model was fitted to yet; the page follows by its news."""
    service = access.service_of(request)
    if service.jobs.active(experiment) is None:
        service.models.refit(experiment, user.name)
    return Response(status_code=204)


@router.post("/steps/diagnose")
def diagnose(
    request: Request, user: access.Operator, experiment: str, joint: JointChoice = None, motion: bool = False
) -> HTMLResponse:
    """Ask what the current model misses, and with `motion` what its missing effects do to predicted motion. The page asks by
    itself: what is computed already is followed."""
    service = access.service_of(request)
    _models_to_change(request, experiment, joint)
    if all(job.kind == FIT_AGAIN for job in service.jobs.unfinished(experiment)):
        service.models.diagnose(experiment, user.name, motion=motion)
    return body(request, user, experiment, joint)


@router.post("/steps/fit-earlier")
def fit_earlier(
    request: Request, user: access.Operator, experiment: str, joint: JointChoice = None
) -> HTMLResponse:
    """Fit the versions again whose error is of other data than the current one's."""
    _models_to_change(request, experiment, joint).fit_earlier_again(experiment, user.name)
    return body(request, user, experiment, joint)


@router.post("/steps/add")
def add(
    request: Request, user: access.Operator, experiment: str, joint: JointChoice, effect: EffectChoice
) -> HTMLResponse:
    """Add an effect to the joint's model."""
    models = _models_to_change(request, experiment, joint)
    models.add_effect(experiment, user.name, effect or "", joint, set_aside=True)
    return body(request, user, experiment, joint)


@router.post("/steps/add-learned")
def add_learned(
    request: Request, user: access.Operator, experiment: str, joint: JointChoice = None
) -> HTMLResponse:
    """Add the description that the diagnosis offers for the joint."""
    models = _models_to_change(request, experiment, joint)
    stored = StoredExperiment(access.service_of(request).experiments, experiment)
    models.add_learned(experiment, user.name, stored.joint_or_first(joint), set_aside=True)
    return body(request, user, experiment, joint)


@router.post("/steps/remove")
def remove(
    request: Request, user: access.Operator, experiment: str, joint: JointChoice, effect: EffectChoice
) -> HTMLResponse:
    """Remove an effect from the joint's model."""
    models = _models_to_change(request, experiment, joint)
    name, at, of_joint = (effect or "").partition("@")
    if at and not of_joint:
        raise Problem(422, f"effect: {effect} names no joint; write {name}@JOINT, or {name} for every joint.")
    models.remove_effect(experiment, user.name, name, of_joint or None, set_aside=True)
    return body(request, user, experiment, joint)


@router.post("/steps/undo")
def undo(request: Request, user: access.Operator, experiment: str, joint: JointChoice = None) -> HTMLResponse:
    """Back to the model before."""
    _models_to_change(request, experiment, joint).undo(experiment, user.name, set_aside=True)
    return body(request, user, experiment, joint)


@router.post("/steps/redo")
def redo(request: Request, user: access.Operator, experiment: str, joint: JointChoice = None) -> HTMLResponse:
    """Forward again."""
    _models_to_change(request, experiment, joint).redo(experiment, user.name, set_aside=True)
    return body(request, user, experiment, joint)


@router.post("/steps/cancel")
def cancel(
    request: Request, user: access.Operator, experiment: str, joint: JointChoice = None
) -> HTMLResponse:
    """Cancel what is being computed."""
    _models_to_change(request, experiment, joint)
    jobs = access.service_of(request).jobs
    if (job := jobs.active(experiment)) is not None:
        jobs.cancel(job.id)
    return body(request, user, experiment, joint)


@router.get("/steps/progress")
def progress(
    request: Request,
    user: access.Viewer,
    experiment: str,
    job: Annotated[str, Query(max_length=32)],
    joint: JointChoice = None,
) -> HTMLResponse:
    """How far the job is; when it has ended, the whole part of the page with what it found."""
    jobs = access.service_of(request).jobs
    known = jobs.get(job)
    if known is not None and not known.state.final and known.kind == FIT_AGAIN:
        stored = StoredExperiment(access.service_of(request).experiments, experiment)
        left = len(stored.story.stale(stored.require_current().version.fit.data))
        again = job_context(known, experiment, joint)
        return page(request, "fitted_again.html", again=again, other_data=left)
    if known is not None and not known.state.final:
        return page(request, "job_progress.html", **job_context(known, experiment, joint))
    response = body(request, user, experiment, joint, ended=known)
    response.headers["HX-Retarget"] = "#steps-body"
    response.headers["HX-Reswap"] = "outerHTML"
    return response


@router.get("/news")
def news(
    request: Request, _user: access.Viewer, experiment: str, seen: Annotated[str, Query(max_length=40)] = ""
) -> Response:
    """What came since a page was drawn from the fit `seen`: progress of a job, or a fresh page for a new fit."""
    service = access.service_of(request)
    fit = fit_key(service.models.story(experiment).read())
    if fit != seen:
        return Response(headers={"HX-Refresh": "true"})
    job = service.jobs.active(experiment)
    if job is not None and job.kind in BESIDE:
        job = None  # shown in its own place, and no other page waits for it
    failed = failed_fit(service.jobs, experiment) if job is None and not fit else None
    return page(request, "news.html", **news_context(experiment, fit, job, failed))


def body(
    request: Request, user: User, experiment: str, joint: str | None, ended: Job | None = None
) -> HTMLResponse:
    """The part of "what is missing" that a step exchanges."""
    service = access.service_of(request)
    stored = StoredExperiment(service.experiments, experiment)
    joint = stored.joint_or_first(joint)
    shown = stored.require_current()
    context = frame(request, user, "missing", experiment) | experiment_context(
        stored, joint, shown, "missing"
    )
    context |= body_context(stored, shown, joint) | job_state(service.jobs, experiment, joint, ended)
    return page(request, "missing_body.html", **context)


def _models_to_change(request: Request, experiment: str, joint: str | None) -> ModelWorkflow:
    """The models, once the address is known to be one that can be answered afterwards: a step that was taken and then
    answered with an error would look as if nothing had happened.

    Raises the problem 404 (experiment, joint), and 409 before the first fit.
    """
    service = access.service_of(request)
    stored = StoredExperiment(service.experiments, experiment)
    stored.joint_or_first(joint)
    stored.story.required()
    return service.models
