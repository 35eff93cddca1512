"""`coulomb backup`: a data folder in one file."""

import json
from dataclasses import asdict
from pathlib import Path
from typing import Annotated

import typer


def register(application: typer.Typer) -> None:
    """Add the command."""
    application.command()(backup)


def backup(
    target: Annotated[Path, typer.Argument(help="Archive to write: .tar, or .tar.gz to pack it.")],
    data: Annotated[Path | None, typer.Option(help="Data folder; COULOMB_DATA, else the user's own.")] = None,
    without_database: Annotated[
        bool, typer.Option(help="Leave the database out: where it is PostgreSQL, copy that by pg_dump.")
    ] = False,
    as_json: Annotated[bool, typer.Option("--json", help="Print JSON.")] = False,
) -> None:
    """Copy experiments, rigs, plans and the database into one archive, also while the service runs."""
    from api.data_folder import default_data_folder
    from api.service.backup import write_backup

    report = write_backup(data or default_data_folder(), target, with_database=not without_database)
    if as_json:
        typer.echo(json.dumps({"archive": str(target)} | asdict(report)))
        return
    database = "with" if report.database else "without"
    typer.echo(f"{target}: {report.files} files, {report.bytes / 1e6:.1f} MB, {database} the database")
