"""What a model misses, and the catalogue of effects."""

from fastapi import APIRouter, Request, Response

from api.contract import Diagnosis, Effect
from api.service import access
from api.service.access import service_of
from api.service.openapi import ResourceRoute, problems
from api.service.problems import Problem
from api.service.routes.experiments import ExperimentId
from api.service.routes.jobs import JobView
from api.service.routes.models import ModelId

router = APIRouter(tags=["diagnoses"], route_class=ResourceRoute)


@router.get("/effects")
def effects(_user: access.Viewer) -> list[Effect]:
    """The catalogue of physical effects."""
    import identify  # SciPy behind it takes a moment; only the first call waits

    return [Effect.model_validate(entry) for entry in identify.catalogue()]


@router.post("/experiments/{experiment}/models/{model}/diagnosis", status_code=202, responses=problems(409))
def diagnose(
    request: Request, response: Response, user: access.Operator, experiment: ExperimentId, model: ModelId
) -> JobView:
    """Find where that model fails and which physical effect is missing."""
    job = service_of(request).models.diagnose(experiment, user.name, model)
    response.headers["Location"] = f"/jobs/{job.id}"
    return JobView.of(job)


@router.get("/experiments/{experiment}/models/{model}/diagnosis")
def get_diagnosis(
    request: Request, _user: access.Viewer, experiment: ExperimentId, model: ModelId
) -> Diagnosis:
    """What was found to be missing in that model: the document of `coulomb diagnose --json`."""
    found = service_of(request).models.story(experiment).diagnosis(model)
    if found is None:
        raise Problem(404, f"The model {model} was not diagnosed yet: POST to this address.")
    return Diagnosis.model_validate(found)


@router.post("/experiments/{experiment}/improvement", status_code=202, responses=problems(409))
def improve(request: Request, response: Response, user: access.Operator, experiment: ExperimentId) -> JobView:
    """Diagnose and add, step by step, until nothing more is justified; every step becomes a model version."""
    job = service_of(request).models.improve(experiment, user.name)
    response.headers["Location"] = f"/jobs/{job.id}"
    return JobView.of(job)
