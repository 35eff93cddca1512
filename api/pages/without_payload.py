"""Table IV of the paper: the same model identified with all sessions, and with those without payload alone.

The second identification is made when it is asked for, as a job, and kept beside the fit that it belongs to.
"""

import json
from dataclasses import replace
from pathlib import Path
from typing import Annotated, Any

from fastapi import APIRouter, Query, Request
from fastapi.responses import HTMLResponse

from api.pages.error_tables import ErrorRow
from api.pages.job_views import follow
from api.pages.layout import experiment_link
from api.pages.rendering import PREFIX
from api.pages.stored_models import ShownModel, StoredExperiment
from api.service import access
from api.service.job_process import Progress
from api.service.problems import Problem

router = APIRouter(prefix=f"{PREFIX}/experiments/{{experiment}}", include_in_schema=False)

FILE = "without-payload.json"
TITLE = "Identifying without payload"


def identify_without_payload(
    progress: Progress, experiment: str, model: str, add: list[str], output: str
) -> dict[str, Any]:
    """Identify a model with the sessions without payload alone; runs in a process of its own.

    output : folder of the fit with all sessions, where the errors are kept

    Returns `samples` and the relative error of every joint. Raises InputError where no session is without payload.
    """
    import identify
    from identify.recording import InputError, load_experiment

    loaded = load_experiment(Path(experiment))
    empty = tuple(
        entry for entry in loaded.sessions if entry.payload.mass == 0 and entry.role == "identification"
    )
    if not empty:
        raise InputError("no session without payload was measured; measure one to compare")
    document = identify.identify(
        replace(loaded, sessions=empty), model=model, add=add, progress=progress
    ).to_json()
    errors = {entry["joint"]: entry["relative_error"] for entry in document["joints"]}
    found = {"samples": document["samples"], "joints": errors}
    (Path(output) / FILE).write_text(json.dumps(found))
    return found


def table_rows(models: list[ShownModel], joint: str) -> list[ErrorRow]:
    """The two rows of Table IV; empty until every model shown was also identified without payload."""
    stored = [_read(model) for model in models]
    if any(each is None for each in stored):
        return []
    varied = tuple(model.joint(joint)["relative_error"] for model in models)
    alone = tuple(each["joints"].get(joint) for each in stored if each is not None)
    return [
        ErrorRow("with payload variations", models[0].document["samples"], varied),
        ErrorRow("without payload", stored[0]["samples"] if stored[0] else 0, alone),
    ]


def can_be_asked(stored: StoredExperiment) -> bool:
    """Whether there are sessions both with and without payload."""
    masses = {payload.name: payload.mass for payload in stored.declared.payloads}
    used = [masses[payload] for payload in stored.payload_of.values()]
    return 0.0 in used and any(used)


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
    wanted = [model for model in (stored.model(each) for each in versions) if _read(model) is None]
    if not wanted:
        raise Problem(409, "That was identified already; load the page again.")
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
                "api.pages.without_payload:identify_without_payload",
                lambda arguments=arguments: arguments,
                lambda found: found,
                user=user.name,
                experiment=experiment,
            )
        )
    return follow(request, submitted[-1].id, TITLE, experiment_link(experiment, "without-payload/progress"))


@router.get("/without-payload/progress")
def progress(
    request: Request, _user: access.Viewer, experiment: str, job: Annotated[str, Query(max_length=32)]
) -> HTMLResponse:
    """How far it is; then a fresh page."""
    return follow(request, job, TITLE, experiment_link(experiment, "without-payload/progress"))


def _read(model: ShownModel) -> dict[str, Any] | None:
    try:
        return json.loads((model.folder / FILE).read_bytes())
    except FileNotFoundError:
        return None
