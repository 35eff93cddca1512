"""`coulomb simulate`."""

from typing import Annotated

import typer

from api.command_arguments import Additions, AsJson, Cluster, Experiment, ModelName, Workers


def register(application: typer.Typer) -> None:
    """Add the command."""
    application.command("simulate")(simulate_command)


def simulate_command(
    experiment: Experiment,
    model: ModelName = "usual",
    add: Additions = None,
    horizon: Annotated[
        list[float] | None,
        typer.Option(
            help="s: length of the windows that begin at measured states; may be repeated; 0.1 and 1"
        ),
    ] = None,
    controller: Annotated[
        str | None,
        typer.Option(
            metavar="FILE",
            help="close the loop with the gains in this YAML file (docs/simulation.md), or 'estimate' to tell"
            " them from the record; without it, those that the drives held when the sessions were recorded close it; where"
            " none are known, or with 'torque', the recorded torque drives the model; 'drives' refuses then",
        ),
    ] = None,
    free_run: Annotated[
        bool,
        typer.Option(help="also run the model from each session's start to its end, which takes longest"),
    ] = True,
    workers: Workers = 1,
    cluster: Cluster = None,
    as_json: AsJson = False,
) -> None:
    """Run an identified model forward on the record: how well it predicts motion, not only torque."""
    from api.computing import Computing
    from api.simulation_text import simulation_text
    from api.stored_experiments import resolve
    from identify.recording import load_experiment
    from identify.results.simulation import HORIZONS
    from identify.simulation.simulate import simulate

    with Computing(workers, cluster)():
        document = simulate(
            load_experiment(resolve(experiment)), model, add or [], horizon or HORIZONS, controller, free_run
        )
    print(document.json_text() if as_json else simulation_text(document))
