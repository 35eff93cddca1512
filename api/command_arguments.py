"""Arguments that several commands share, said once."""

from pathlib import Path
from typing import Annotated

import typer

Experiment = Annotated[str, typer.Argument(help="folder, experiment.yaml, or name of a stored experiment")]
ExperimentOrRecord = Annotated[
    str,
    typer.Argument(
        help="folder, experiment.yaml, or name of a stored experiment; with --robot a record of joints (MCAP, rosbag)"
    ),
]
RecordRobot = Annotated[Path | None, typer.Option("--robot", help="URDF, SDF or MJCF of a record's robot")]
RecordTip = Annotated[str | None, typer.Option("--tip", help="link at which the chain ends")]
RecordTopic = Annotated[
    str | None,
    typer.Option("--topic", help="of a recording of ROS, whose joints are the robot's, if several hold them"),
]
ModelName = Annotated[
    str,
    typer.Option(
        help="rigid, usual, load-velocity, rigid+effect,effect…, or link-side (torque sensors behind the gear)"
    ),
]
Additions = Annotated[list[str] | None, typer.Option(help="EFFECT or EFFECT@JOINT; may be repeated")]
AsJson = Annotated[bool, typer.Option("--json", help="one JSON document on stdout")]
Workers = Annotated[
    int, typer.Option(min=1, max=256, help="processes of this machine that sessions are divided among")
]
WorkersOfDiagnosis = Annotated[
    int | None,
    typer.Option(
        min=1,
        max=256,
        help="processes that sessions are divided among; if not said, joints are divided among two where there are two cores",
    ),
]
Cluster = Annotated[
    str | None,
    typer.Option(help="a Dask scheduler whose workers are used instead (tcp://host:8786; extra 'dask')"),
]

JudgeMotion = Annotated[
    bool,
    typer.Option(
        "--motion",
        help="also predict motion a second ahead where the fit did not see, and say of each effect whether that gets worse",
    ),
]

KeepLearned = Annotated[
    bool,
    typer.Option(
        "--keep-learned",
        help="write every description that is offered beside the experiment and name it under its effects, so that --add"
        " takes it like any other",
    ),
]
