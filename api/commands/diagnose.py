"""`coulomb diagnose` and `coulomb improve`."""

import typer

from api.command_arguments import (
    Additions,
    AsJson,
    Cluster,
    Experiment,
    JudgeMotion,
    ModelName,
    RecordRobot,
    RecordTip,
    Workers,
)


def register(application: typer.Typer) -> None:
    """Add the commands."""
    application.command("diagnose")(diagnose_command)
    application.command("improve")(improve_command)


def diagnose_command(
    experiment: Experiment,
    model: ModelName = "usual",
    add: Additions = None,
    robot: RecordRobot = None,
    tip: RecordTip = None,
    motion: JudgeMotion = False,
    workers: Workers = 1,
    cluster: Cluster = None,
    as_json: AsJson = False,
) -> None:
    """Say where a model fails and which physical effect is missing."""
    from api.computing import Computing
    from api.diagnosis_text import diagnosis_text
    from api.record_experiment import opened_experiment
    from identify.diagnosis.diagnosis import diagnose

    with Computing(workers, cluster)(), opened_experiment(experiment, robot, tip) as loaded:
        document = diagnose(loaded, model, add or [], motion=motion).document()
    print(document.json_text() if as_json else diagnosis_text(document))


def improve_command(
    experiment: Experiment,
    model: ModelName = "usual",
    robot: RecordRobot = None,
    tip: RecordTip = None,
    motion: JudgeMotion = False,
    workers: Workers = 1,
    cluster: Cluster = None,
    as_json: AsJson = False,
) -> None:
    """Diagnose a model and add what is missing, step by step, until nothing more is justified."""
    from api.computing import Computing
    from api.diagnosis_text import improvement_text
    from api.record_experiment import opened_experiment
    from identify.diagnosis.improvement import improve

    with Computing(workers, cluster)(), opened_experiment(experiment, robot, tip) as loaded:
        document = improve(loaded, model, motion=motion).document()
    print(document.json_text() if as_json else improvement_text(document))
