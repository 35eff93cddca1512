"""What a command's EXPERIMENT may be besides an experiment: a record of joints and the URDF of its robot."""

import sys
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from api.stored_experiments import resolve
from identify.recording import Experiment, InputError, load_experiment
from identify.recording.experiment_file import EXPERIMENT_FILE

_SETTINGS = (".yaml", ".yml")


@contextmanager
def opened_experiment(
    given: str, robot: Path | None = None, tip: str | None = None, topic: str | None = None
) -> Iterator[Experiment]:
    """The experiment of a folder, a file or a name; or one made of a record for as long as the context lasts.

    robot, tip : URDF of the record's robot, and the link at which its chain ends
    topic      : of a recording of ROS, whose joints are the robot's

    Raises InputError: it is none of these; a record lacks its robot, or columns of its joints.
    """
    path = Path(given)
    folder_of_record = (
        path.is_dir() and not (path / EXPERIMENT_FILE).exists() and (path / "metadata.yaml").exists()
    )
    if not folder_of_record and not (path.is_file() and path.suffix.lower() not in _SETTINGS):
        if robot is not None:
            raise InputError(f"--robot: {given} is an experiment, which has its robot; leave it out")
        if topic is not None:
            raise InputError(f"--topic: {given} is an experiment, not a recording of ROS; leave it out")
        yield load_experiment(resolve(given))
        return
    if robot is None:
        raise InputError(
            f"{path}: is a record; name its robot by --robot FILE.urdf, or make an experiment: coulomb import"
        )
    with tempfile.TemporaryDirectory(prefix="coulomb-record-") as folder:
        yield _imported(path, robot, tip, topic, Path(folder) / "experiment")


def _imported(path: Path, robot: Path, tip: str | None, topic: str | None, folder: Path) -> Experiment:
    from api.foreign_robot import columns_of_joints, urdf_robot
    from identify.recording import Payload
    from identify.recording.foreign import ColumnMap, measure, read_foreign
    from identify.recording.foreign_import import NewSession, import_sessions

    table = read_foreign(path, topic=topic)
    made, prior = urdf_robot(robot, tip, None, None, {})
    if not table.joints:
        raise InputError(
            f"{path}: does not say which column belongs to which joint; name them once: coulomb import {path.name}"
            f" --robot {robot.name} --time ... --position ... --command ..."
        )
    positions, efforts = columns_of_joints(table, [joint.name for joint in made.joints])
    columns = ColumnMap(tuple(positions), tuple(efforts), table.time)
    measured = measure(table, columns, [not joint.revolute for joint in made.joints], "drop")
    for remark in measured.remarks:
        print(f"{path.name}: {remark}", file=sys.stderr)
    carried = Payload(name="none", mass=0.0)
    session = NewSession("session-00.csv", measured, carried, "identification")
    return import_sessions([session], folder, made, path.name, columns, prior)
