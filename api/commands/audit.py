"""`coulomb audit`: whether the log of what people changed is as it was written."""

import json
from dataclasses import asdict
from pathlib import Path
from typing import Annotated

import typer

audit = typer.Typer(help="The log of all that people changed.", no_args_is_help=True)


def register(application: typer.Typer) -> None:
    """Add the group of commands."""
    application.add_typer(audit, name="audit")


@audit.callback()
def _group() -> None:
    """The log of all that people changed."""


@audit.command()
def verify(
    noted: Annotated[
        str | None, typer.Option(help="Digest that an earlier check printed; it must still be in the log.")
    ] = None,
    data: Annotated[Path | None, typer.Option(help="Data folder; COULOMB_DATA, else the user's own.")] = None,
    database: Annotated[str | None, typer.Option(help="SQLAlchemy address of another database.")] = None,
    as_json: Annotated[bool, typer.Option("--json", help="Print JSON.")] = False,
) -> None:
    """Check that no row was changed or removed; exit status 1 if one was.

    The newest rows can be cut off without a trace in the log itself. Note the digest that is printed in another place, and
    give it to the next check.
    """
    from api.service.open_data import open_data

    with open_data(data, database) as opened:
        checked = opened.audit.check(noted)
    if as_json:
        typer.echo(json.dumps(asdict(checked) | {"ok": checked.ok}))
    elif checked.broken_at is not None:
        typer.echo(
            f"row {checked.broken_at} does not follow from those before: it, or one before it, was changed or removed"
        )
    elif checked.noted is False:
        typer.echo(
            f"{checked.rows} rows follow from each other, but the digest {noted} is not among them: rows were removed"
        )
    else:
        typer.echo(f"{checked.rows} rows, none changed; digest {checked.head}")
    if not checked.ok:
        raise typer.Exit(1)
