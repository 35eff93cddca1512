"""`coulomb drive-gains`: the gains of the drives' own position controllers, as a file for `simulate --controller`."""

from pathlib import Path
from typing import Annotated

import typer

from api.command_arguments import AsJson


def register(application: typer.Typer) -> None:
    """Add the command."""
    application.command("drive-gains")(drive_gains)


def drive_gains(
    rig: Annotated[str, typer.Argument(help="rig file, or the name of one in config/rigs")],
    out: Annotated[
        Path | None, typer.Option(help="write the file of controllers here; left out, it is printed")
    ] = None,
    as_json: AsJson = False,
) -> None:
    """Read the gains of the drives' position controllers; nothing is written to a drive.

    They are converted to the units of the record: command per rad or m of the joint. A session reads them by itself and keeps
    them with the recording, so that `coulomb simulate` closes the loop with them; this file is for other records.
    """
    from api.controller_text import controller_yaml
    from daq.rig import Rig
    from daq.servo_gains import gains_of
    from identify.recording.atomic_file import write_atomically

    controllers = gains_of(Rig.load(rig))
    text = controllers.model_dump_json() if as_json else controller_yaml(controllers)
    if out is None:
        print(text)
    else:
        write_atomically(out, controller_yaml(controllers).encode())
        print(text if as_json else f"{out}: gains of {len(controllers.joints)} drives")
