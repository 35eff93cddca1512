"""Table IV of the paper: the same model identified with the sessions without payload alone.

It is made when it is asked for, as a job, and kept beside the fit with all sessions.
"""

import json
from dataclasses import replace
from pathlib import Path
from typing import Any

from api.service.job_process import Progress

FILE = "without-payload.json"


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


def errors_without_payload(fit_folder: Path) -> dict[str, Any] | None:
    """What `identify_without_payload` found for that fit; None where nobody asked yet."""
    try:
        return json.loads((fit_folder / FILE).read_bytes())
    except FileNotFoundError:
        return None
