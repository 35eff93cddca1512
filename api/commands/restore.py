"""`coulomb restore`: a data folder made of a backup."""

import json
from dataclasses import asdict
from pathlib import Path
from typing import Annotated

import typer


def register(application: typer.Typer) -> None:
    """Add the command."""
    application.command()(restore)


def restore(
    archive: Annotated[
        Path, typer.Argument(help="An archive of `coulomb backup`.", exists=True, dir_okay=False)
    ],
    data: Annotated[Path, typer.Option(help="Folder to make; it must not be there, or be empty.")],
    database: Annotated[str | None, typer.Option(help="SQLAlchemy address of another database.")] = None,
    as_json: Annotated[bool, typer.Option("--json", help="Print JSON.")] = False,
) -> None:
    """Check a backup, make a data folder of it, and bring its database and index up to this version."""
    from api.service.backup import restore_backup
    from api.service.open_data import open_data

    report = restore_backup(archive, data)
    with open_data(data, database) as opened:
        experiments = opened.experiments.reindex()
        opened.note("restore", archive.name, {"files": report.files})
    if as_json:
        typer.echo(json.dumps({"data": str(data), "experiments": experiments} | asdict(report)))
        return
    typer.echo(
        f"{data}: {report.files} files, {experiments} experiments; serve it with coulomb serve --data {data}"
    )
