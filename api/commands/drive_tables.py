"""`coulomb drive-tables`: friction and cogging as the drives' own compensation takes them."""

import os
from pathlib import Path
from typing import Annotated

import typer

from api.command_arguments import Additions, AsJson, ModelName


def register(application: typer.Typer) -> None:
    """Add the command."""
    application.command("drive-tables")(drive_tables)


def drive_tables(
    rig: Annotated[str, typer.Argument(help="rig file, or the name of one in config/rigs")],
    experiment: Annotated[
        str | None, typer.Option(help="of this robot: folder, experiment.yaml, or name of a stored one")
    ] = None,
    model: ModelName = "load-velocity",
    add: Additions = None,
    write: Annotated[
        bool, typer.Option("--write", help="write the tables and read them back; left out, they are shown")
    ] = False,
    clear: Annotated[
        bool, typer.Option("--clear", help="instead of a model's: no current, so that the tables do nothing")
    ] = False,
    back_to: Annotated[
        Path | None,
        typer.Option(
            help="instead of a model's: what the drives held before; the file has what --write --json printed"
        ),
    ] = None,
    keep: Annotated[
        Path | None,
        typer.Option(
            help="file that what the drives held is written to before anything else, for --back-to; left out, one is made here"
        ),
    ] = None,
    yes: Annotated[bool, typer.Option("--yes", help="write without asking; simulated rigs only")] = False,
    as_json: AsJson = False,
) -> None:
    """Show a model's friction and cogging as the drives' own compensation takes them; with --write, the drives hold them.

    Support points are chosen for the least error on the record. Nothing is written to a drive that has power, moves or has a
    fault; every object is read back, and if one is refused all get back what they held. With --clear or --back-to no experiment
    is needed: the drives get tables without current, or what they held before.
    """
    from datetime import UTC, datetime

    from api.drive_tables import cleared_tables, tables_before, written
    from api.drive_tables import drive_tables as tables_of
    from api.drive_tables_text import drive_tables_text, tables_text
    from api.stored_experiments import resolve
    from daq.homing import require_lasting_drives
    from daq.rig import Rig
    from identify.identification import identify
    from identify.recording import InputError, load_experiment
    from identify.recording.atomic_file import write_atomically
    from identify.results.drive_tables import DriveTablesDocument
    from identify.results.reading import read_named_document

    settings = Rig.load(rig)
    if yes and settings.simulated is None:
        raise InputError(
            "--yes: is for simulated rigs; a real drive's settings are changed by a person who sees it"
        )
    kept = keep or Path(f"drive-tables-before-{settings.name}-{datetime.now(UTC):%Y%m%dT%H%M%SZ}.json")
    if write:
        require_lasting_drives(settings)
        _require_room_for(kept)
    if sum((clear, back_to is not None, experiment is not None)) != 1:
        raise InputError("drive-tables: give one of --experiment, --clear and --back-to")
    if clear:
        document = cleared_tables(settings)
    elif back_to is not None:
        document = tables_before(read_named_document(DriveTablesDocument, back_to), settings)
    else:
        result = identify(load_experiment(resolve(experiment or "")), model, add or [])
        document = tables_of(result, settings)
    if write:
        if not yes:
            typer.echo(tables_text(document), err=True)
            if not typer.confirm(f"Write these tables to the drives of rig {settings.name}?", err=True):
                raise typer.Exit(1)

        def keep_before(before: DriveTablesDocument) -> None:
            write_atomically(kept, (before.json_text(indent=1) + "\n").encode())
            typer.echo(
                f"what the drives held is kept in {kept}; coulomb drive-tables {rig} --back-to {kept} --write gives it to them"
                " again",
                err=True,
            )

        document = written(document, settings, keep_before)
    print(document.json_text() if as_json else drive_tables_text(document))


def _require_room_for(kept: Path) -> None:
    """Raises InputError: what the drives hold cannot be kept in this file."""
    from identify.recording import InputError

    folder = kept.resolve().parent
    if not os.access(folder, os.W_OK):
        problem = "cannot be written to" if folder.is_dir() else "is no folder"
        raise InputError(
            f"--keep {kept}: {folder} {problem}; what the drives hold is kept there before it changes"
        )
    if kept.exists():
        raise InputError(
            f"--keep {kept}: exists already, and may say what drives held before; choose another name, and nothing is lost"
        )
