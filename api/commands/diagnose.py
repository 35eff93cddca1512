"""`coulomb diagnose` and `coulomb improve`."""

import sys
from typing import TYPE_CHECKING

import typer

from api.command_arguments import (
    Additions,
    AsJson,
    Cluster,
    ExperimentOrRecord,
    JudgeMotion,
    KeepLearned,
    ModelName,
    RecordRobot,
    RecordTip,
    RecordTopic,
    WorkersOfDiagnosis,
)

if TYPE_CHECKING:
    from identify.recording import Experiment as LoadedExperiment
    from identify.results.diagnosis import Learned


def register(application: typer.Typer) -> None:
    """Add the commands."""
    application.command("diagnose")(diagnose_command)
    application.command("improve")(improve_command)


def diagnose_command(
    experiment: ExperimentOrRecord,
    model: ModelName = "usual",
    add: Additions = None,
    robot: RecordRobot = None,
    tip: RecordTip = None,
    topic: RecordTopic = None,
    motion: JudgeMotion = False,
    keep_learned: KeepLearned = False,
    workers: WorkersOfDiagnosis = None,
    cluster: Cluster = None,
    as_json: AsJson = False,
) -> None:
    """Say where a model fails and which physical effect is missing."""
    from api.computing import Computing
    from api.diagnosis_text import diagnosis_text
    from api.record_experiment import opened_experiment
    from identify.diagnosis.diagnosis import diagnose

    with (
        Computing.of_diagnosis(workers, cluster)(),
        opened_experiment(experiment, robot, tip, topic) as loaded,
    ):
        document = diagnose(loaded, model, add or [], motion=motion).document()
        if keep_learned:
            _keep(loaded, [joint.learned for joint in document.joints if joint.learned is not None])
    print(document.json_text() if as_json else diagnosis_text(document))


def improve_command(
    experiment: ExperimentOrRecord,
    model: ModelName = "usual",
    robot: RecordRobot = None,
    tip: RecordTip = None,
    topic: RecordTopic = None,
    motion: JudgeMotion = False,
    keep_learned: KeepLearned = False,
    workers: WorkersOfDiagnosis = None,
    cluster: Cluster = None,
    as_json: AsJson = False,
) -> None:
    """Diagnose a model and add what is missing, step by step, until nothing more is justified."""
    from api.computing import Computing
    from api.diagnosis_text import improvement_text
    from api.record_experiment import opened_experiment
    from identify.diagnosis.improvement import improve

    with (
        Computing.of_diagnosis(workers, cluster)(),
        opened_experiment(experiment, robot, tip, topic) as loaded,
    ):
        document = improve(loaded, model, motion=motion).document()
        if keep_learned:
            _keep(loaded, list((document.learned or {}).values()))
    print(document.json_text() if as_json else improvement_text(document))


def _keep(experiment: "LoadedExperiment", learned: "list[Learned]") -> None:
    """Write what is offered beside the experiment, and say where.

    Raises InputError: a file of that name is there.
    """
    from identify.recording import append_effect

    for each in learned:
        print(f"{append_effect(experiment.folder, each.effect, each.file)}: written", file=sys.stderr)
