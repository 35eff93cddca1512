"""What is missing: the verdict, the ranked effects with their evidence, and the error falling from version to version."""

from fastapi import APIRouter, Request
from fastapi.responses import HTMLResponse

from api.pages.choices import EffectChoice, JointChoice
from api.pages.evidence_view import joint_diagnosis, selected_evidence
from api.pages.experiment_frame import experiment_context, no_model_page
from api.pages.job_views import job_state
from api.pages.layout import frame
from api.pages.missing_body import body_context
from api.pages.rendering import PREFIX, page
from api.pages.stored_models import StoredExperiment
from api.service import access

router = APIRouter(prefix=PREFIX, include_in_schema=False)


@router.get("/experiments/{experiment}/missing")
def missing_page(
    request: Request,
    user: access.Viewer,
    experiment: str,
    joint: JointChoice = None,
    effect: EffectChoice = None,
) -> HTMLResponse:
    """The page."""
    stored = StoredExperiment(access.service_of(request).experiments, experiment)
    context = frame(request, user, "missing", experiment)
    joint = stored.joint_or_first(joint)
    shown = stored.current()
    context |= experiment_context(stored, joint, shown, "missing")
    if shown is None:
        return no_model_page(request, stored, joint, context)
    context |= body_context(stored, shown, joint, effect)
    context |= job_state(access.service_of(request).jobs, experiment, joint) | {"own_news": True}
    return page(request, "missing.html", **context)


@router.get("/experiments/{experiment}/missing/evidence")
def evidence(
    request: Request,
    _user: access.Viewer,
    experiment: str,
    joint: JointChoice = None,
    effect: EffectChoice = None,
) -> HTMLResponse:
    """The fragment that shows one effect."""
    stored = StoredExperiment(access.service_of(request).experiments, experiment)
    joint = stored.joint_or_first(joint)
    shown = stored.current()
    if shown is None:
        return page(request, "evidence.html", selected=None)
    diagnosis = joint_diagnosis(stored, shown, joint)
    return page(request, "evidence.html", selected=selected_evidence(stored, shown, diagnosis, joint, effect))
