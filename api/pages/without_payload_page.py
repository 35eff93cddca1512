"""Table IV of the paper: the same model identified with all sessions, and with those without payload alone.

The second identification is made when it is asked for, as a job, and kept beside the fit that it belongs to.
"""

from typing import Annotated

from fastapi import APIRouter, Query, Request
from fastapi.responses import HTMLResponse

from api.pages.job_views import follow
from api.pages.layout import experiment_link
from api.pages.rendering import PREFIX
from api.pages.stored_models import StoredExperiment
from api.service import access
from api.service.job_documents import JobResult
from api.service.problems import Problem
from api.service.without_payload import errors_without_payload

router = APIRouter(prefix=f"{PREFIX}/experiments/{{experiment}}", include_in_schema=False)

TITLE = "Identifying without payload"


@router.post("/without-payload")
def ask(
    request: Request,
    user: access.Operator,
    experiment: str,
    versions: Annotated[list[str], Query(alias="version", max_length=2)],
) -> HTMLResponse:
    """Identify the versions that are shown without payload too."""
    service = access.service_of(request)
    stored = StoredExperiment(service.experiments, experiment)
    wanted = [
        model
        for model in (stored.model(each) for each in versions)
        if errors_without_payload(model.folder) is None
    ]
    if not wanted:
        raise Problem(409, "That was identified already; load the page again.")
    service.jobs.refuse_more(user.name, len(wanted))
    submitted = []
    for model in wanted:
        arguments = {
            "experiment": str(stored.folder),
            "model": model.version.model,
            "add": model.version.add,
            "output": str(model.folder),
        }
        submitted.append(
            service.jobs.submit(
                "identify",
                "api.service.without_payload:identify_without_payload",
                lambda arguments=arguments: arguments,
                lambda _errors, model=model.version.id: JobResult(model=model),
                user=user.name,
                experiment=experiment,
            )
        )
    return follow(
        request, submitted[-1].id, experiment_link(experiment, "without-payload/progress"), title=TITLE
    )


@router.get("/without-payload/progress")
def progress(
    request: Request, _user: access.Viewer, experiment: str, job: Annotated[str, Query(max_length=32)]
) -> HTMLResponse:
    """How far it is; then a fresh page."""
    return follow(request, job, experiment_link(experiment, "without-payload/progress"), title=TITLE)
