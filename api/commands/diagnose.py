"""`coulomb diagnose` and `coulomb improve`."""

import typer

from api.command_arguments import Additions, AsJson, Experiment, ModelName


def register(application: typer.Typer) -> None:
    """Add the commands."""
    application.command("diagnose")(diagnose_command)
    application.command("improve")(improve_command)


def diagnose_command(
    experiment: Experiment, model: ModelName = "usual", add: Additions = None, as_json: AsJson = False
) -> None:
    """Say where a model fails and which physical effect is missing."""
    from api.diagnosis_text import diagnosis_text
    from api.stored_experiments import resolve
    from identify.diagnosis.diagnosis import diagnose
    from identify.recording import load_experiment

    document = diagnose(load_experiment(resolve(experiment)), model, add or []).document()
    print(document.json_text() if as_json else diagnosis_text(document))


def improve_command(experiment: Experiment, model: ModelName = "usual", as_json: AsJson = False) -> None:
    """Diagnose a model and add what is missing, step by step, until nothing more is justified."""
    from api.diagnosis_text import improvement_text
    from api.stored_experiments import resolve
    from identify.diagnosis.improvement import improve
    from identify.recording import load_experiment

    document = improve(load_experiment(resolve(experiment)), model).document()
    print(document.json_text() if as_json else improvement_text(document))
