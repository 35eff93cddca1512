"""The identified model as a URDF: one choice of standard parameters of real bodies that has the identified base parameters.

It is computed when it is asked for, as a job, and kept beside the fit that it belongs to. It needs the extra `feasible`.
"""

import importlib.util
from pathlib import Path
from typing import Annotated

from fastapi import APIRouter, Query, Request
from fastapi.responses import HTMLResponse

from api.pages.job_views import follow
from api.pages.layout import experiment_link
from api.pages.rendering import PREFIX
from api.pages.stored_models import ShownModel, StoredExperiment
from api.service import access
from api.service.job_process import Progress

router = APIRouter(prefix=f"{PREFIX}/experiments/{{experiment}}", include_in_schema=False)

URDF_FILE = "model.urdf"
TITLE = "Looking for real bodies with these parameters"


def urdf_of(shown: ShownModel) -> str | None:
    """The text of the URDF that was written beside the fit, or None where there is none."""
    file = shown.folder / URDF_FILE
    return file.read_text() if file.is_file() else None


def can_be_made() -> bool:
    """Whether the extra `feasible` is installed."""
    return all(importlib.util.find_spec(name) is not None for name in ("cvxpy", "clarabel"))


def write_identified_urdf(
    progress: Progress, experiment: str, model: str, add: list[str], output: str
) -> str:
    """Identify, take the nearest feasible standard parameters, and write the URDF; runs in a process of its own.

    output : folder of the fit

    Returns the file's name. Raises InputError where the model has no base parameters of its own.
    """
    import identify
    from identify.dynamics.urdf import write_urdf
    from identify.estimation.feasible import feasible_document
    from identify.recording import InputError, load_experiment

    loaded = load_experiment(Path(experiment))
    result = identify.identify(
        loaded, model=model, add=add, progress=lambda done, words: progress(0.6 * done, words)
    )
    progress(0.6, "standard parameters of real bodies")
    standard = [entry["value"] for entry in feasible_document(result)["standard"]]
    values = {parameter.name: parameter.value for parameter in result.parameters}
    losses = [[values.get(f"{name}{joint + 1}", 0.0) for joint in range(loaded.n)] for name in ("FV", "FC")]
    try:
        write_urdf(
            Path(output) / URDF_FILE,
            loaded.robot,
            standard,
            name=loaded.name,
            damping=losses[0],
            friction=losses[1],
        )
    except ValueError as error:
        raise InputError(str(error)) from error
    return URDF_FILE


@router.post("/urdf")
def make(
    request: Request, user: access.Operator, experiment: str, version: Annotated[str, Query(max_length=12)]
) -> HTMLResponse:
    """Make the URDF of a version."""
    service = access.service_of(request)
    stored = StoredExperiment(service.experiments, experiment)
    shown = stored.model(version)
    arguments = {
        "experiment": str(stored.folder),
        "model": shown.version.model,
        "add": shown.version.add,
        "output": str(shown.folder),
    }
    job = service.jobs.submit(
        "identify",
        "api.pages.urdf_file:write_identified_urdf",
        lambda: arguments,
        lambda name: {"file": name},
        user=user.name,
        experiment=experiment,
    )
    return follow(request, job.id, TITLE, experiment_link(experiment, "urdf/progress"))


@router.get("/urdf/progress")
def progress(
    request: Request, _user: access.Viewer, experiment: str, job: Annotated[str, Query(max_length=32)]
) -> HTMLResponse:
    """How far it is; then a fresh page with the download."""
    return follow(request, job, TITLE, experiment_link(experiment, "urdf/progress"))
