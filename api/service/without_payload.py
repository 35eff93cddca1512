"""Table IV of the paper: the same model identified with the sessions without payload alone.

It is made when it is asked for, as a job, and kept beside the fit with all sessions.
"""

from dataclasses import replace
from pathlib import Path

from pydantic import BaseModel, ConfigDict, Field

from api.service.job_process import Progress

FILE = "without-payload.json"


class ErrorsWithoutPayload(BaseModel):
    """Errors of a model that was identified with the sessions without payload alone."""

    model_config = ConfigDict(frozen=True, extra="forbid")

    samples: int = Field(description="decimated rows of the fit, over all joints")
    joints: dict[str, float | None] = Field(description="relative error of each joint, by its name")


def identify_without_payload(
    progress: Progress, experiment: str, model: str, add: list[str], output: str
) -> ErrorsWithoutPayload:
    """Identify a model with the sessions without payload alone; runs in a process of its own.

    output : folder of the fit with all sessions, where the errors are kept

    Raises InputError where no session is without payload.
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
    ).document()
    errors = {entry.joint: entry.relative_error for entry in document.joints}
    result = ErrorsWithoutPayload(samples=document.samples, joints=errors)
    (Path(output) / FILE).write_text(result.model_dump_json())
    return result


def errors_without_payload(fit_folder: Path) -> ErrorsWithoutPayload | None:
    """What `identify_without_payload` found for that fit; None where nobody asked yet."""
    try:
        return ErrorsWithoutPayload.model_validate_json((fit_folder / FILE).read_bytes())
    except FileNotFoundError:
        return None
