"""`coulomb compare`: models side by side, in figures and in one table of errors."""

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from api.command_arguments import AsJson, Cluster, Experiment, Workers

if TYPE_CHECKING:
    from identify.results.comparison import ComparisonDocument


def register(application: typer.Typer) -> None:
    """Add the command."""
    application.command("compare")(compare_command)


def compare_command(
    experiment: Experiment,
    out: Annotated[Path, typer.Option(help="folder for the figures (PNG and SVG), made if need be")],
    model: Annotated[
        list[str] | None,
        typer.Option(help="may be repeated; usual and load-velocity if not said"),
    ] = None,
    add: Annotated[
        list[str] | None,
        typer.Option(
            help="EFFECT or EFFECT@JOINT for the last model, which is also compared without it if alone"
        ),
    ] = None,
    workers: Workers = 1,
    cluster: Cluster = None,
    as_json: AsJson = False,
) -> None:
    """Draw measured, predicted and error of every model, and set their errors side by side."""
    from api.computing import Computing
    from api.stored_experiments import resolve
    from identify.comparison import compare, comparison_document, write_figures
    from identify.recording import load_experiment

    with Computing(workers, cluster)():
        results = compare(load_experiment(resolve(experiment)), model or [], add or [])
        figures = [str(out / file) for file in write_figures(results, out)]
        document = comparison_document(results, figures)
    if as_json:
        print(document.json_text())
    else:
        _print(document, out)


def _print(document: "ComparisonDocument", out: Path) -> None:
    from api.identification_tables import console_for_tables, errors_of_models

    console = console_for_tables()
    console.print(errors_of_models(document.models))
    console.print(f"{len(document.figures)} figures in {out}")
