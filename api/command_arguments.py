"""Arguments that several commands share, said once."""

from typing import Annotated

import typer

Experiment = Annotated[str, typer.Argument(help="folder, experiment.yaml, or name of a stored experiment")]
ModelName = Annotated[str, typer.Option(help="rigid, usual, load-velocity, or rigid+effect,effect…")]
Additions = Annotated[list[str] | None, typer.Option(help="EFFECT or EFFECT@JOINT; may be repeated")]
AsJson = Annotated[bool, typer.Option("--json", help="one JSON document on stdout")]
