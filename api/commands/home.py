"""`coulomb home`: home drives, and reset their faults."""

import json
from typing import Annotated

import typer


def register(application: typer.Typer) -> None:
    """Add the command."""
    application.command("home")(home)


def home(
    rig: Annotated[str, typer.Argument(help="name of a rig in config/rigs, or a rig file")],
    joints: Annotated[
        list[str] | None,
        typer.Argument(help="joints, in this order; left out, all whose axis has `homing: drive`"),
    ] = None,
    method: Annotated[
        int | None,
        typer.Option(
            help="homing method 0x6098 (37: here is home, without motion); left out, the drive's own",
            min=-128,
            max=127,
        ),
    ] = None,
    reset_faults: Annotated[
        bool, typer.Option("--reset-faults", help="reset the drives' faults first, and say what they were")
    ] = False,
    yes: Annotated[bool, typer.Option("--yes", help="start without asking; simulated rigs only")] = False,
    as_json: Annotated[bool, typer.Option("--json", help="one JSON document on stdout")] = False,
) -> None:
    """Home the joints of a rig, one after the other, each after a question. The drive moves the axis; Ctrl-C stops it.

    No limit of the rig file watches this motion, for before homing a position means nothing: stand by the machine.
    """
    from rich.console import Console

    from daq.homing import Homing, joints_to_home, require_lasting_drives
    from daq.rig import Rig
    from drivers.errors import DriverError
    from identify.recording.errors import InputError

    settings = Rig.load(rig)
    if yes and settings.simulated is None:
        raise InputError("--yes: is for simulated rigs; a real robot is started by a person who sees it")
    require_lasting_drives(settings)
    named = tuple(joints or ())
    wanted = joints_to_home(settings, named)
    console = Console(stderr=True)
    homed = []
    resets: list[str] = []
    try:
        with Homing(settings) as homing:
            if reset_faults:
                resets = homing.reset_faults()
                for line in resets:
                    console.print(line, highlight=False)
            for index in wanted:
                joint = settings.axes[index].joint
                moves = (
                    "will take its present position as its home"
                    if method in (35, 37)
                    else "will move to find its home"
                )
                if not yes and not typer.confirm(f"Joint {joint} {moves}. Start?", err=True):
                    raise typer.Exit(1)
                homed_joint = homing.home(index, method)
                homed.append(homed_joint)
                colour = "green" if homed_joint.within_limits else "yellow"
                console.print(f"[{colour}]joint {joint}[/]: {homed_joint.words}", highlight=False)
    except DriverError as error:
        console.print(f"[red]{error}[/]", highlight=False)
        raise typer.Exit(1) from None
    if as_json:
        print(
            json.dumps(
                {
                    "rig": settings.name,
                    "faults_reset": resets,
                    "joints": [
                        {
                            "joint": h.joint,
                            "position": h.position,
                            "within_limits": h.within_limits,
                            "words": h.words,
                        }
                        for h in homed
                    ],
                },
                ensure_ascii=False,
            )
        )
