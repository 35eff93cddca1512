"""`coulomb robot`: the robot's section of an experiment from a URDF, SDF or MJCF, and what can be identified of it."""

from pathlib import Path
from typing import TYPE_CHECKING, Annotated, NamedTuple

import typer

if TYPE_CHECKING:
    from identify.dynamics.base_parameters import BaseParameters
    from identify.recording import Robot
    from identify.results.document import Json


def register(application: typer.Typer) -> None:
    """Add the command."""
    application.command("robot")(robot_command)


def robot_command(
    urdf: Annotated[Path, typer.Argument(help="URDF, SDF or MJCF file of a serial robot")],
    tip: Annotated[
        str | None, typer.Option(help="link at which the chain ends, where movable joints branch")
    ] = None,
    gravity: Annotated[tuple[float, float, float], typer.Option(help="m/s², in the base link")] = (
        0.0,
        0.0,
        -9.81,
    ),
    as_json: Annotated[bool, typer.Option("--json", help="print one JSON document")] = False,
) -> None:
    """Turn a URDF, SDF or MJCF into the `robot:` section of an experiment.yaml, and list its base parameters.

    Drive gains are not in such a file: they are written as 1 (the command is then the joint torque); put in yours.
    """
    import json
    import sys

    from identify.dynamics.base_parameters import base_parameters
    from identify.dynamics.geometry import Geometry
    from identify.dynamics.urdf import read_urdf
    from identify.recording.strict_yaml import strict_yaml_text

    read = read_urdf(urdf, tip=tip, gravity=gravity)
    base = base_parameters(Geometry.from_robot(read.robot))
    section = robot_section(read.robot)
    if as_json:
        document = {
            "robot": section,
            "base_parameters": [row._asdict() for row in parameter_rows(base)],
            "remarks": list(read.remarks),
        }
        print(json.dumps(document, ensure_ascii=False))
        return
    for remark in read.remarks:
        print(f"{urdf}: {remark}", file=sys.stderr)
    print(strict_yaml_text({"robot": section}, width=200, lists_in_line=True), end="")
    print(f"\n# {len(base)} base parameters can be identified of {len(read.standard)} standard ones:")
    for row in parameter_rows(base):
        print(f"#   {row.name:<7} {row.unit:<7} {row.joint}: {row.grouping}")


def robot_section(robot: "Robot") -> "Json":
    """The robot as it stands in an experiment.yaml, without fields left at null."""
    return robot.model_dump(mode="json", exclude_none=True)


class ParameterRow(NamedTuple):
    """A base parameter as it is listed."""

    name: str
    unit: str
    joint: str
    grouping: str


def parameter_rows(base: "BaseParameters") -> list[ParameterRow]:
    """Each base parameter, in their order."""
    columns = zip(base.names, base.units, base.joints, base.groupings, strict=True)
    return [ParameterRow(*row) for row in columns]
