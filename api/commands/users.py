"""`coulomb users`: who may sign in, and bearer tokens."""

import getpass
import json
import sys
from pathlib import Path
from typing import Annotated

import typer

from identify.recording.errors import InputError

Data = Annotated[Path | None, typer.Option(help="Data folder; COULOMB_DATA, else the user's own.")]
DatabaseUrl = Annotated[str | None, typer.Option(help="SQLAlchemy address of another database.")]
RoleName = Annotated[str, typer.Option(help="viewer, operator or admin.")]
AsJson = Annotated[bool, typer.Option("--json", help="Print JSON.")]
Name = Annotated[str, typer.Argument(help="Name of the user.")]

users = typer.Typer(
    help="Who may sign in to the service, and bearer tokens for scripts.", no_args_is_help=True
)


def register(application: typer.Typer) -> None:
    """Add the group of commands."""
    application.add_typer(users, name="users")


@users.command()
def add(name: Name, role: RoleName = "viewer", data: Data = None, database: DatabaseUrl = None) -> None:
    """Create a user; the password is asked for, or read as one line from standard input."""
    from api.service.open_data import open_data

    with open_data(data, database) as opened:
        opened.accounts.add_user(name, _password(), _role(role))
        opened.note("users add", name, {"role": role})
    typer.echo(f"{name} may sign in as {role}")


@users.command("list")
def list_(data: Data = None, database: DatabaseUrl = None, as_json: AsJson = False) -> None:
    """Everybody who may sign in."""
    from api.service.open_data import open_data

    with open_data(data, database) as opened:
        listed = [(row.name, row.role) for row in opened.accounts.users()]
    if as_json:
        typer.echo(json.dumps([{"name": name, "role": role} for name, role in listed]))
        return
    for name, role in listed:
        typer.echo(f"{name:<24} {role}")


@users.command()
def change(
    name: Name,
    role: Annotated[str | None, typer.Option(help="The new role.")] = None,
    password: Annotated[bool, typer.Option(help="Ask for a new password.")] = False,
    data: Data = None,
    database: DatabaseUrl = None,
) -> None:
    """Change a user's role or password; the user signs in again."""
    from api.service.open_data import open_data

    if role is None and not password:
        raise InputError("users change: give --role ROLE, --password, or both")
    with open_data(data, database) as opened:
        opened.accounts.change_user(
            name, role=_role(role) if role else None, password=_password() if password else None
        )
        opened.note("users change", name, {"role": role, "password": password})
    typer.echo(f"{name} is changed")


@users.command()
def remove(name: Name, data: Data = None, database: DatabaseUrl = None) -> None:
    """Remove a user with all sign-ins and tokens."""
    from api.service.open_data import open_data

    with open_data(data, database) as opened:
        opened.accounts.remove_user(name)
        opened.note("users remove", name, {})
    typer.echo(f"{name} is removed")


@users.command()
def token(
    name: Name,
    label: Annotated[str, typer.Option(help="What it is for.")] = "command line",
    scope: Annotated[
        str, typer.Option(help="viewer, operator or admin; at most the user's role.")
    ] = "viewer",
    days: Annotated[float, typer.Option(min=0.0, max=366.0, help="How long it lasts.")] = 30.0,
    data: Data = None,
    database: DatabaseUrl = None,
) -> None:
    """Make a bearer token for REST; it is printed this once."""
    from api.service.open_data import open_data

    with open_data(data, database) as opened:
        issued = opened.accounts.issue_token(name, label, _role(scope), days * 86400.0)
        opened.note("users token", name, {"label": label, "scope": scope, "days": days})
    typer.echo(issued.secret)


def _password() -> str:
    if sys.stdin.isatty():
        first = getpass.getpass("Password: ")
        if getpass.getpass("Again: ") != first:
            raise InputError("password: the two are not the same")
        return first
    return sys.stdin.readline().rstrip("\r\n")


def _role(name: str):
    from api.service.accounts import Role

    try:
        return Role(name)
    except ValueError:
        raise InputError(f"role: {name!r} is not one of {', '.join(Role)}") from None
