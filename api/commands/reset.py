"""`coulomb reset`: bring the drives of a rig to rest without power and without fault."""

import dataclasses
import json
from typing import Annotated

import typer


def register(application: typer.Typer) -> None:
    """Add the command."""
    application.command("reset")(reset)


def reset(
    rig: Annotated[str, typer.Argument(help="name of a rig in config/rigs, or a rig file")],
    yes: Annotated[bool, typer.Option("--yes", help="do it without asking")] = False,
    as_json: Annotated[bool, typer.Option("--json", help="one JSON document on stdout")] = False,
) -> None:
    """Reset the faults of a rig's drives, and take the power of those that have some. No axis is moved, no zero changed.

    An axis without a brake sinks when its power goes: stand by the machine.
    """
    from rich.console import Console

    from daq.drive_reset import reset_drives
    from daq.homing import require_lasting_drives
    from daq.rig import Rig
    from drivers.errors import DriverError

    settings = Rig.load(rig)
    require_lasting_drives(settings)
    console = Console(stderr=True)
    if not yes and not typer.confirm(
        f"Rig {settings.name}: drives that have power lose it, faults are reset. Is the cause gone?", err=True
    ):
        raise typer.Exit(1)
    try:
        joints = reset_drives(settings)
    except DriverError as error:
        console.print(f"[red]{error}[/]", highlight=False)
        raise typer.Exit(1) from None
    for joint in joints:
        colour = "green" if joint.ok else "red"
        console.print(f"[{colour}]joint {joint.joint}[/] (node {joint.node}): {joint.words}", highlight=False)
    if as_json:
        document = {"rig": settings.name, "joints": [dataclasses.asdict(joint) for joint in joints]}
        print(json.dumps(document, ensure_ascii=False))
    if not all(joint.ok for joint in joints):
        raise typer.Exit(1)
