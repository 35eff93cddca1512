"""`coulomb diagnose` and `coulomb improve`."""

import json
from typing import Annotated

import typer

Experiment = Annotated[str, typer.Argument(help="folder, experiment.yaml, or name of a stored experiment")]
ModelName = Annotated[str, typer.Option(help="rigid, usual, load-velocity, or rigid+effect,effect…")]
Additions = Annotated[list[str] | None, typer.Option(help="EFFECT or EFFECT@JOINT; may be repeated")]
AsJson = Annotated[bool, typer.Option("--json", help="one JSON document on stdout")]


def register(application: typer.Typer) -> None:
    """Add the commands."""
    application.command("diagnose")(diagnose_command)
    application.command("improve")(improve_command)


def diagnose_command(
    experiment: Experiment, model: ModelName = "usual", add: Additions = None, as_json: AsJson = False
) -> None:
    """Say where a model fails and which physical effect is missing."""
    from api.stored_experiments import resolve
    from identify.diagnosis.diagnosis import diagnose
    from identify.recording import load_experiment

    result = diagnose(load_experiment(resolve(experiment)), model, add or [])
    print(json.dumps(result.to_json(), ensure_ascii=False, allow_nan=False))


def improve_command(experiment: Experiment, model: ModelName = "usual", as_json: AsJson = False) -> None:
    """Diagnose a model and add what is missing, step by step, until nothing more is justified."""
    from api.stored_experiments import resolve
    from identify.diagnosis.improvement import improve
    from identify.recording import load_experiment

    result = improve(load_experiment(resolve(experiment)), model)
    print(json.dumps(result.to_json(), ensure_ascii=False, allow_nan=False))
