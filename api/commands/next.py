"""`coulomb next`: the experiment that would separate two rival explanations best."""

from typing import Annotated

import typer

from api.command_arguments import Additions, AsJson, Cluster, Experiment, ModelName, Workers


def register(application: typer.Typer) -> None:
    """Add the command."""
    application.command("next")(next_command)


def next_command(
    experiment: Experiment,
    model: ModelName = "usual",
    add: Additions = None,
    between: Annotated[
        list[str] | None, typer.Option(help="an effect to separate from another; give it twice")
    ] = None,
    workers: Workers = 1,
    cluster: Cluster = None,
    as_json: AsJson = False,
) -> None:
    """Plan the experiment (payload, speed, range, repeats) that would separate what the diagnosis cannot tell apart."""
    from api.computing import Computing
    from api.stored_experiments import resolve
    from identify.diagnosis.next_experiment import next_experiment
    from identify.recording import InputError, load_experiment

    if between and len(between) != 2:
        raise InputError("--between: give it twice, once for each of the two effects")
    with Computing(workers, cluster)():
        result = next_experiment(load_experiment(resolve(experiment)), model, add or [], between or [])
    if as_json:
        print(result.json_text())
        return
    print(result.advice)
    if result.proposals:
        print("  probability  separation")
    for proposal in result.proposals:
        span = f"from {proposal.position_from:.3g} to {proposal.position_to:.3g}"
        print(
            f"  {proposal.probability or 0.0:11.2f} {proposal.separation or 0.0:9.1f} σ  {proposal.shape:10s}"
            f" payload {proposal.payload}, up to {proposal.speed:.3g}/s, {span}, {proposal.repeats} repeats"
        )
