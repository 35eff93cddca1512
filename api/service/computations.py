"""What jobs compute, in processes of their own: identification, diagnosis, improvement.

Each function takes `progress` first (see job_process.py) and returns documents or what holds them. The predicted and
measured torques, which are as long as the recordings, go into files beside the model, from where a plot reads the part
that it shows.
"""

from dataclasses import dataclass, replace
from pathlib import Path

import identify
from api.service.job_process import Progress
from api.service.model_story import IDENTIFICATION_FILE, data_fingerprint
from api.service.prediction_files import write_candidate, write_prediction
from identify.recording import load_experiment
from identify.recording.experiment_file import EXPERIMENT_FILE, read_experiment_file
from identify.results.diagnosis import DiagnosisDocument
from identify.results.identification import IdentificationDocument
from identify.results.improvement import ImprovementDocument
from identify.results.next_experiment import NextExperimentDocument

PICTURED = 6
"""Best candidates of each joint whose effect on the residual is shown before anybody adds them."""


@dataclass(frozen=True)
class FitFound:
    """A fit that was made: what it found, the fingerprint of the data that it was made of, and the folder of its files."""

    identification: IdentificationDocument
    data: str
    folder: Path


@dataclass(frozen=True)
class ImprovedVersion:
    """A model of an improvement: all effects added so far, the one added last, and its fit."""

    add: list[str]
    change: str
    fit: FitFound


@dataclass(frozen=True)
class ImprovementFound:
    """An improvement, and one fitted version for each step after the start."""

    improvement: ImprovementDocument
    versions: list[ImprovedVersion]


def fit(progress: Progress, experiment: str, model: str, add: list[str], output: str) -> FitFound:
    """Identify one model over all identification sessions.

    experiment : folder of the experiment
    output     : folder for identification.json and the predictions
    """
    # Taken before reading: a session that comes while this computes makes the fit old.
    data = data_fingerprint(Path(experiment))
    loaded = load_experiment(Path(experiment))
    result = identify.identify(loaded, model=model, add=add, progress=_part(progress, 0.0, 0.8))
    document = result.document()
    folder = Path(output)
    folder.mkdir(parents=True, exist_ok=True)  # the service has made it, so that nobody else takes its place
    places = _places(experiment)
    pairs = [(entry, joint) for entry in loaded.sessions for joint in range(len(loaded.robot.joints))]
    for done, (entry, joint) in enumerate(pairs):
        progress(0.8 + 0.2 * done / len(pairs), "storing measured and predicted torque")
        name = loaded.robot.joints[joint].name
        write_prediction(folder, places[entry.file], joint, result.prediction(entry.file, name))
    (folder / IDENTIFICATION_FILE).write_text(document.json_text(indent=1), encoding="utf-8")
    return FitFound(document, data, folder)


def diagnose(
    progress: Progress, experiment: str, model: str, add: list[str], output: str, motion: bool = False
) -> DiagnosisDocument:
    """Where that model fails and which effect is missing.

    output : folder of the fit, where the torque is kept that the model would predict with each of the best candidates
    motion : whether motion is predicted too, where the fit did not see
    """
    from identify.diagnosis.with_candidate import predictions_with, shown_findings

    loaded = load_experiment(Path(experiment))
    searched = 0.5 if motion else 0.85
    diagnosis = identify.diagnose(loaded, model=model, add=add, progress=_part(progress, 0.0, searched))
    if motion:
        from identify.diagnosis.motion_judgement import effects_on_motion

        progress(searched, "predicting motion that the fits did not see")
        diagnosis = replace(diagnosis, motion=effects_on_motion(diagnosis.fitted, diagnosis.added))
    looks = [
        (joint, finding)
        for joint in range(len(diagnosis.joints))
        for finding in shown_findings(diagnosis, joint, PICTURED)
    ]
    places = _places(experiment)
    for done, (joint, finding) in enumerate(looks):
        progress(0.85 + 0.15 * done / len(looks), "looking at what each effect would leave")
        rank = 1 + diagnosis.joints[joint].findings.index(finding)
        predictions = predictions_with(diagnosis, finding, loaded.sessions)
        for entry, prediction in zip(loaded.sessions, predictions, strict=True):
            write_candidate(Path(output), places[entry.file], joint, rank, prediction.predicted)
    return diagnosis.document()


def separate(
    progress: Progress, experiment: str, model: str, add: list[str], joint: str, diagnosis: DiagnosisDocument
) -> NextExperimentDocument | None:
    """The experiment that tells apart what a diagnosis left open on one joint.

    None where nothing is left open there.
    """
    from identify.diagnosis.next_experiment import separate_diagnosed
    from identify.estimation.requested_model import open_record, requested_model

    progress(0.05, "reading the sessions")
    record = open_record(load_experiment(Path(experiment)), model)
    progress(0.2, "trying payloads, speeds and ranges on both models")
    return separate_diagnosed(record, requested_model(record, model, add), diagnosis, joint)


def improve(
    progress: Progress,
    experiment: str,
    model: str,
    add: list[str],
    models: str,
    first: int,
    motion: bool = False,
) -> ImprovementFound:
    """Add effects step by step until nothing more is justified, and fit each step's model.

    models, first : folder of the story, number of the first new version: step k is fitted into `m{first +
    k}/f1`
    """
    loaded = load_experiment(Path(experiment))
    story = identify.improve(loaded, model=model, add=add, progress=_part(progress, 0.0, 0.6), motion=motion)
    document = story.document()
    changes = [str(step.added) for step in document.steps if step.added is not None]
    versions = []
    for number, change in enumerate(changes):
        add = [*add, change]
        begin, end = (0.6 + 0.4 * (number + part) / len(changes) for part in (0, 1))
        output = Path(models) / f"m{first + number}" / "f1"
        fitted = fit(_part(progress, begin, end), experiment, model, add, str(output))
        versions.append(ImprovedVersion(add, change, fitted))
    return ImprovementFound(document, versions)


def _places(experiment: str) -> dict[str, int]:
    """Session file -> its place in the experiment's file, which stays when a session is excluded."""
    declared = read_experiment_file(Path(experiment) / EXPERIMENT_FILE)
    return {session.file: place for place, session in enumerate(declared.sessions)}


def _part(progress: Progress, begin: float, end: float) -> Progress:
    """The progress of a part of the work, as a share of the whole."""
    return lambda fraction, step: progress(begin + (end - begin) * fraction, step)
