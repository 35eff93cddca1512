"""What jobs compute, in processes of their own: identification, diagnosis, improvement.

Each function takes `progress` first (see job_process.py). Results are JSON; the predicted and measured
torques, which are as long as the recordings, go into files beside the model, from where a plot reads the
part that it shows.
"""

import json
from pathlib import Path
from typing import Any

import numpy as np

import identify
from api.service.job_process import Progress
from api.service.model_story import data_fingerprint
from api.service.prediction_files import write_candidate, write_prediction
from identify.recording import load_experiment
from identify.results.diagnosis import DiagnosisDocument
from identify.results.reading import document_of

PICTURED = 6
"""Best candidates of each joint whose effect on the residual is shown before anybody adds them."""


def fit(progress: Progress, experiment: str, model: str, add: list[str], output: str) -> dict[str, Any]:
    """Identify one model over all identification sessions.

    experiment : folder of the experiment
    output     : folder, made here, for identification.json and the predictions

    Returns `identification`, the JSON of `coulomb identify`, and `data`, the fingerprint of what was fitted.
    """
    # Taken before reading: a session that comes while this computes makes the fit old.
    data = data_fingerprint(Path(experiment))
    loaded = load_experiment(Path(experiment))
    result = identify.identify(loaded, model=model, add=add, progress=_part(progress, 0.0, 0.8))
    document = _finite(result.to_json())
    folder = Path(output)
    folder.mkdir(parents=True)
    pairs = [
        (entry, joint) for entry in range(len(loaded.sessions)) for joint in range(len(loaded.robot.joints))
    ]
    for done, (session, joint) in enumerate(pairs):
        progress(0.8 + 0.2 * done / len(pairs), "storing measured and predicted torque")
        entry, name = loaded.sessions[session], loaded.robot.joints[joint].name
        write_prediction(folder, session, joint, result.prediction(entry.file, name))
    (folder / "identification.json").write_text(json.dumps(document, indent=1))
    return {"identification": document, "data": data}


def diagnose(progress: Progress, experiment: str, model: str, add: list[str], output: str) -> dict[str, Any]:
    """Where that model fails and which effect is missing: the JSON of `coulomb diagnose`.

    output : folder of the fit, where the torque is kept that the model would predict with each of the best candidates
    """
    from identify.diagnosis.with_candidate import predictions_with, worth_a_look

    loaded = load_experiment(Path(experiment))
    found = identify.diagnose(loaded, model=model, add=add, progress=_part(progress, 0.0, 0.85))
    looks = [
        (joint, finding)
        for joint in range(len(found.joints))
        for finding in worth_a_look(found, joint, PICTURED)
    ]
    for done, (joint, finding) in enumerate(looks):
        progress(0.85 + 0.15 * done / len(looks), "looking at what each effect would leave")
        rank = 1 + found.joints[joint].findings.index(finding)
        for session, prediction in enumerate(predictions_with(found, finding, loaded.sessions)):
            write_candidate(Path(output), session, joint, rank, prediction.predicted)
    return _finite(found.to_json())


def separate(
    progress: Progress, experiment: str, model: str, add: list[str], joint: str, diagnosis: dict[str, Any]
) -> dict[str, Any] | None:
    """The experiment that tells apart what a diagnosis left open on one joint: the JSON of `coulomb next`.

    None where nothing is left open there.
    """
    from identify.diagnosis.next_experiment import separate_diagnosed
    from identify.estimation.requested_model import open_record, requested_model

    progress(0.05, "reading the sessions")
    record = open_record(load_experiment(Path(experiment)))
    progress(0.2, "trying payloads, speeds and ranges on both models")
    kept = document_of(DiagnosisDocument, diagnosis, "the stored diagnosis")
    found = separate_diagnosed(record, requested_model(record, model, add), kept, joint)
    return None if found is None else _finite(found.to_json())


def improve(
    progress: Progress, experiment: str, model: str, add: list[str], models: str, first: int
) -> dict[str, Any]:
    """Add effects step by step until nothing more is justified, and fit each step's model.

    models, first : folder of the story, number of the first new version: step k is fitted into `m{first +
    k}/f1`

    Returns `improvement`, the JSON of `coulomb improve`, and `versions`, one for each step after the start:
    `add`, `change`, `identification`, `data`.
    """
    loaded = load_experiment(Path(experiment))
    story = identify.improve(loaded, model=model, add=add, progress=_part(progress, 0.0, 0.6))
    document = _finite(story.to_json())
    changes = [_effect_text(step["added"]) for step in document["steps"] if step["added"] is not None]
    versions = []
    for number, change in enumerate(changes):
        add = [*add, change]
        begin, end = (0.6 + 0.4 * (number + part) / len(changes) for part in (0, 1))
        output = Path(models) / f"m{first + number}" / "f1"
        fitted = fit(_part(progress, begin, end), experiment, model, add, str(output))
        versions.append({"add": add, "change": change, **fitted})
    return {"improvement": document, "versions": versions}


def _effect_text(added: dict[str, Any]) -> str:
    """`effect@joint`, as the command line spells it."""
    return f"{added['effect']}@{added['joint']}" if added.get("joint") else added["effect"]


def _part(progress: Progress, begin: float, end: float) -> Progress:
    """The progress of a part of the work, as a share of the whole."""
    return lambda fraction, words: progress(begin + (end - begin) * fraction, words)


def _finite(value: Any) -> Any:
    """The document with null for what is not a finite number: JSON has no other way to say so."""
    if isinstance(value, dict):
        return {key: _finite(item) for key, item in value.items()}
    if isinstance(value, list | tuple):
        return [_finite(item) for item in value]
    if isinstance(value, np.generic):
        value = value.item()
    if isinstance(value, float) and not np.isfinite(value):
        return None
    return value
