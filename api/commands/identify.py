"""`coulomb identify` and `coulomb effects`."""

import json
from pathlib import Path
from typing import Annotated

import typer

from api.command_arguments import (
    Additions,
    AsJson,
    Cluster,
    ExperimentOrRecord,
    ModelName,
    RecordTip,
    Workers,
)


def register(application: typer.Typer) -> None:
    """Add the commands."""
    application.command("identify")(identify_command)
    application.command("effects")(effects_command)


def identify_command(
    experiment: ExperimentOrRecord,
    model: ModelName = "usual",
    add: Additions = None,
    estimator: Annotated[
        str | None,
        typer.Option(
            help="ordinary, weighted, robust or instrumental; if not said, weighted for several joints"
        ),
    ] = None,
    essential: Annotated[
        bool, typer.Option("--essential", help="eliminate the parameters that the data do not show")
    ] = False,
    payload: Annotated[
        list[str] | None,
        typer.Option(help="fit only the sessions with this payload; may be repeated; the others are checked"),
    ] = None,
    unknown_payload: Annotated[
        list[str] | None,
        typer.Option(help="estimate inertia, centre and mass of this payload; may be repeated"),
    ] = None,
    feasible: Annotated[
        bool,
        typer.Option("--feasible", help="also the nearest physically consistent inertias (extra 'feasible')"),
    ] = False,
    robot: Annotated[
        Path | None,
        typer.Option(
            "--robot",
            help="URDF, SDF or MJCF of the robot: its inertias beside the identified ones, instead of those that the experiment"
            " was imported with",
        ),
    ] = None,
    tip: RecordTip = None,
    workers: Workers = 1,
    cluster: Cluster = None,
    as_json: AsJson = False,
) -> None:
    """Fit a model to all identification sessions at once and check it on the validation sessions."""
    from api.computing import Computing
    from api.stored_experiments import resolve
    from identify.identification import identify
    from identify.recording import load_experiment

    with Computing(workers, cluster)():
        result = identify(
            load_experiment(resolve(experiment)),
            model,
            add or [],
            estimator=estimator,
            essential=essential,
            payloads=payload or [],
            unknown_payloads=unknown_payload or [],
        )
        document = result.document()
    if feasible:
        from identify.estimation.feasible import feasible_parameters

        document = document.changed(feasible=feasible_parameters(result))
    if robot is not None:
        from identify.validation.prior_inertias import compared_with_prior, prior_of_file

        prior = prior_of_file(robot, tip, result.experiment.robot)
        document = document.changed(prior=compared_with_prior(result, document.parameters, prior))
    if as_json:
        print(document.json_text())
    else:
        from api.identification_tables import print_identification

        print_identification(document)


def effects_command(
    as_json: AsJson = False,
    as_markdown: Annotated[bool, typer.Option("--markdown", help="the document docs/effects.md")] = False,
) -> None:
    """The catalogue of effects: equation, explanation, what data each needs."""
    from identify.effects.catalogue import catalogue

    if as_json:
        print(json.dumps([effect.to_json() for effect in catalogue()], ensure_ascii=False))
    elif as_markdown:
        from identify.effects.document import effects_document

        print(effects_document(), end="")
    else:
        from api.identification_tables import print_effects

        print_effects(catalogue())
