"""Models of an experiment: fit, add an effect, remove, undo, redo, compare; results."""

from typing import Annotated

from fastapi import APIRouter, Path, Query, Request, Response
from pydantic import Field

from api.service import access, text_forms
from api.service.access import service_of
from api.service.job_documents import JobView
from api.service.model_documents import Comparison, Pending, ResultsView, Stepped, StoryView, VersionView
from api.service.openapi import ResourceRoute, problems
from api.service.problems import Problem
from api.service.request_document import RequestDocument
from api.service.routes.experiments import ExperimentId
from api.service.routes.jobs import accepted

router = APIRouter(tags=["models"], route_class=ResourceRoute)

ModelId = Annotated[str, Path(pattern=text_forms.MODEL_ID)]
ModelName = Annotated[str, Field(max_length=1000, pattern=text_forms.MODEL_NAME, examples=["usual"])]
EffectName = Annotated[
    str, Field(max_length=64, pattern=text_forms.EFFECT, examples=["load-friction-asymmetric"])
]
JointName = Annotated[str, Field(max_length=64, min_length=1, examples=["j3"])]


class FitRequest(RequestDocument):
    """A model to be fitted: `rigid`, `usual`, `load-velocity` or `rigid+EFFECT,EFFECT…`, and effects to
    add.
    """

    model: ModelName = "usual"
    add: list[Annotated[str, Field(max_length=130, pattern=text_forms.EFFECT_AT_JOINT)]] = Field(
        default=[], max_length=200, examples=[["stribeck@j3"]]
    )


class EffectChange(RequestDocument):
    """An effect to add or remove, on one joint or on all."""

    effect: EffectName
    joint: JointName | None = None


@router.get(
    "/experiments/{experiment}/results",
    tags=["results"],
    responses={202: {"model": Pending, "description": "The first identification is being computed."}},
)
def get_results(
    request: Request, response: Response, _user: access.Viewer, experiment: ExperimentId
) -> ResultsView | Pending:
    """Results of the identifier over all sessions so far. They are computed by themselves after every
    session.
    """
    results = service_of(request).models.results(experiment)
    job = JobView.model_validate(results.job) if results.job else None
    if results.version is None or results.identification is None:
        if job is None:
            raise Problem(404, "There are no results yet: measure or import a session first.")
        response.status_code = 202
        return Pending(job=job)
    return ResultsView.model_validate(
        {
            **dict(results.identification),
            "version": results.version,
            "stale": results.stale,
            "job": job,
            "diagnosis": results.diagnosis,
        }
    )


@router.get("/experiments/{experiment}/models")
def get_story(request: Request, _user: access.Viewer, experiment: ExperimentId) -> StoryView:
    """All model versions of an experiment, which one stands, and what can be redone."""
    story = service_of(request).models.story(experiment).read()
    current = story.current
    return StoryView(
        versions=story.versions, line=story.line, undone=story.undone, current=current.id if current else None
    )


@router.post("/experiments/{experiment}/models", status_code=202, responses=problems(409))
def fit_model(
    request: Request, response: Response, user: access.Operator, experiment: ExperimentId, wanted: FitRequest
) -> JobView:
    """Fit a model; it becomes the current one."""
    job = service_of(request).models.fit(experiment, user.name, wanted.model, wanted.add)
    return accepted(job, response)


@router.post("/experiments/{experiment}/models/refit", status_code=202)
def refit_model(
    request: Request, response: Response, user: access.Operator, experiment: ExperimentId
) -> JobView:
    """Fit the current model over all sessions so far, as happens by itself after every session."""
    return accepted(service_of(request).models.refit(experiment, user.name), response)


@router.post("/experiments/{experiment}/models/effects", status_code=202, responses=problems(409))
def add_effect(
    request: Request,
    response: Response,
    user: access.Operator,
    experiment: ExperimentId,
    change: EffectChange,
) -> JobView:
    """Add an effect to the current model."""
    job = service_of(request).models.add_effect(experiment, user.name, change.effect, change.joint)
    return accepted(job, response)


@router.post("/experiments/{experiment}/models/effects/remove", status_code=202, responses=problems(409))
def remove_effect(
    request: Request,
    response: Response,
    user: access.Operator,
    experiment: ExperimentId,
    change: EffectChange,
) -> JobView:
    """Remove an effect from the current model."""
    job = service_of(request).models.remove_effect(experiment, user.name, change.effect, change.joint)
    return accepted(job, response)


@router.post("/experiments/{experiment}/models/undo", responses=problems(409))
def undo(request: Request, user: access.Operator, experiment: ExperimentId) -> Stepped:
    """Go back to the model before."""
    version, job = service_of(request).models.undo(experiment, user.name)
    return Stepped(version=version, job=JobView.model_validate(job) if job else None)


@router.post("/experiments/{experiment}/models/redo", responses=problems(409))
def redo(request: Request, user: access.Operator, experiment: ExperimentId) -> Stepped:
    """Take back the last undo."""
    version, job = service_of(request).models.redo(experiment, user.name)
    return Stepped(version=version, job=JobView.model_validate(job) if job else None)


@router.get("/experiments/{experiment}/models/compare")
def compare(
    request: Request,
    _user: access.Viewer,
    experiment: ExperimentId,
    first: Annotated[str, Query(pattern=text_forms.MODEL_ID, examples=["m1"])],
    second: Annotated[str, Query(pattern=text_forms.MODEL_ID, examples=["m2"])],
) -> Comparison:
    """Two versions side by side."""
    story = service_of(request).models.story(experiment)
    left, right = (story.identification(each) for each in (first, second))
    before, after = ({str(each) for each in document.effects} for document in (left, right))
    known = left.relative_error is not None and right.relative_error is not None
    return Comparison(
        first=left,
        second=right,
        added=sorted(after - before),
        removed=sorted(before - after),
        relative_error_change=right.relative_error - left.relative_error if known else None,  # type: ignore[operator]
    )


@router.get("/experiments/{experiment}/models/{model}")
def get_model(
    request: Request, _user: access.Viewer, experiment: ExperimentId, model: ModelId
) -> VersionView:
    """One model version with its newest fit and what was found to be missing in it."""
    story = service_of(request).models.story(experiment)
    return VersionView(
        version=story.read().version(model),
        identification=story.identification(model),
        diagnosis=story.diagnosis(model),
    )
