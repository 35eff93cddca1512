"""`coulomb reindex`: the service's index of experiments, rebuilt from the folders."""

import json
from pathlib import Path
from typing import Annotated

import typer


def register(application: typer.Typer) -> None:
    """Add the command."""
    application.command()(reindex)


def reindex(
    data: Annotated[Path | None, typer.Option(help="Data folder; COULOMB_DATA, else the user's own.")] = None,
    database: Annotated[str | None, typer.Option(help="SQLAlchemy address of another database.")] = None,
    as_json: Annotated[bool, typer.Option("--json", help="Print JSON.")] = False,
) -> None:
    """Rebuild the index of stored experiments; the folders are the truth, accounts and audit log stay."""
    from api.service.open_data import open_data

    with open_data(data, database) as opened:
        count = opened.experiments.reindex()
        broken = {row.id: row.problem for row in opened.experiments.rows() if row.problem}
    if as_json:
        typer.echo(json.dumps({"experiments": count, "problems": broken}))
        return
    typer.echo(f"{count} experiments indexed")
    for identifier, problem in broken.items():
        typer.echo(f"{identifier}: {problem}")
