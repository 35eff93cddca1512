"""Other people's records: what is in them, and the experiment that they become; read in a process of its own
(confined_reader.py).
"""

import re
from collections.abc import Sequence
from pathlib import Path

import numpy as np

from api.foreign_robot import typed_robot, urdf_robot
from api.service.job_process import Progress
from api.service.record_documents import (
    CanLogImport,
    Dialect,
    RecordColumn,
    RecordDescription,
    RecordImport,
)
from identify.recording import InputError, Payload, Robot
from identify.recording.experiment_file import PriorBodies
from identify.recording.foreign import (
    ColumnMap,
    CsvOptions,
    ForeignColumn,
    ForeignTable,
    measure,
    read_foreign,
)
from identify.recording.foreign.guesses import guess_roles
from identify.recording.foreign.joining import join_session
from identify.recording.foreign_import import NewSession, import_sessions
from identify.validation.prior_inertias import prior_of_file

OUTLINE_BLOCKS = 60
"""Blocks of a column's outline: its smallest and largest value in each."""
MOST_COLUMNS = 200
"""That are described of one file."""


def describe_records(
    progress: Progress, folder: str, files: list[str], dialect: Dialect
) -> list[RecordDescription]:
    """What each file in the folder holds.

    Raises InputError: names the file.
    """
    with _Words(folder):
        return [_description(table) for table in _read(folder, files, dialect)]


def import_records(
    progress: Progress,
    folder: str,
    files: list[str],
    robot: str | None,
    known: Robot | None,
    wanted: RecordImport,
    target: str,
) -> tuple[str, ...]:
    """Make the experiment in the folder `target`; what was decided, in words.

    robot : file in the folder that describes the robot; None where the joints say it
    known : the robot of the experiment that gets the sessions; None for a new experiment

    Raises InputError: names the file and column, or the field.
    """
    with _Words(folder):
        tables = _read(folder, files, wanted.dialect)
        of_robot = Path(folder) / robot if robot else None
        if known is None:
            made, prior = _robot(wanted, of_robot, tables[0])
        else:
            made, prior = known, prior_of_file(of_robot, wanted.tip, known) if of_robot else None
        columns = _columns(wanted, tables)
        if wanted.join and len(tables) > 1:
            joined, columns = join_session(tables, wanted.time, columns, wanted.repair)
            tables = [joined]
        if len(wanted.payloads) not in (1, len(tables)):
            raise InputError(
                f"payloads: {len(wanted.payloads)} given for {len(tables)} sessions; give one, or {len(tables)}"
            )
        carried = [Payload(**each.model_dump()) for each in wanted.payloads]
        prismatic = [not joint.revolute for joint in made.joints]
        sessions = [
            NewSession(
                f"session-{place:02d}.csv",
                measure(table, columns, prismatic, wanted.repair),
                carried[min(place, len(carried) - 1)],
                wanted.role,
            )
            for place, table in enumerate(tables)
        ]
        import_sessions(sessions, Path(target), made, wanted.name, columns, prior)
        return tuple(remark for each in sessions for remark in each.measured.remarks)


def import_can_records(
    progress: Progress,
    folder: str,
    files: list[str],
    rig: str,
    known: Robot | None,
    wanted: CanLogImport,
    target: str,
) -> tuple[str, ...]:
    """Make the experiment of a rig's CAN logs in the folder `target`; what was decided, in words.

    rig   : file of the rig
    known : the robot of the experiment that gets the sessions; None for a new experiment

    Raises InputError: names the file and what it lacks, or the field.
    """
    from api.can_log_import import import_can_logs

    with _Words(folder):
        experiment, sessions = import_can_logs(
            [Path(folder) / file for file in files],
            rig,
            Path(target),
            append=False,
            name=wanted.name,
            payload=wanted.payload,
            role=wanted.role,
            begin=wanted.begin,
            end=wanted.end,
        )
        if known is not None and experiment.robot != known:
            raise InputError(
                f"experiment: its robot is not that of the rig {wanted.rig}; make a new experiment"
            )
        return tuple(remark for each in sessions for remark in each.remarks)


class _Words:
    """What is wrong is said in words of the upload: without its folder, fields instead of options."""

    def __init__(self, folder: str) -> None:
        self._folder = folder

    def __enter__(self) -> None:
        return None

    def __exit__(self, kind: object, error: object, trace: object) -> None:
        if not isinstance(error, InputError):
            return
        sentence = re.sub(rf"{re.escape(self._folder)}/(\d+/)?", "", str(error))
        sentence = re.sub(r"--([a-z]+(?:-[a-z]+)*)", lambda option: option[1].replace("-", "_"), sentence)
        raise InputError(sentence) from error


def _read(folder: str, files: list[str], dialect: Dialect) -> list[ForeignTable]:
    options = CsvOptions(dialect.header_line, dialect.separator, dialect.decimal)
    return [read_foreign(Path(folder) / file, options) for file in files]


def _columns(wanted: RecordImport, tables: Sequence[ForeignTable]) -> ColumnMap:
    joints = wanted.joints
    if not wanted.time and wanted.rate is None and any(table.period is None for table in tables):
        raise InputError("time: is missing; name the time column, or give rate in Hz")
    if len(wanted.time) > 1 and not (wanted.join and len(tables) > 1):
        raise InputError(f"time: {len(wanted.time)} given; one is for all files, unless they are joined")
    given = [joint.resolution for joint in joints]
    return ColumnMap(
        tuple(joint.position for joint in joints),
        tuple(joint.command for joint in joints),
        time=wanted.time[0] if wanted.time else None,
        rate=None if wanted.time else wanted.rate,
        time_unit=wanted.time_unit,
        position_unit=_stated("position_unit", [joint.position_unit for joint in joints]),
        command_unit=_stated("command_unit", [joint.command_unit for joint in joints]),
        resolution=tuple(each or 0.0 for each in given) if any(given) else (),
        external=_stated("external", [joint.external for joint in joints]),
        temperature=_stated("temperature", [joint.temperature for joint in joints]),
        extra=tuple(wanted.keep),
    )


def _stated(field: str, given: list[str | None]) -> tuple[str, ...]:
    """Units or columns of all joints, or none."""
    if not any(given):
        return ()
    missing = [place for place, each in enumerate(given) if not each]
    if missing:
        raise InputError(f"joints.{missing[0]}.{field}: is missing; state it of every joint, or of none")
    return tuple(each for each in given if each)


def _robot(wanted: RecordImport, file: Path | None, table: ForeignTable) -> tuple[Robot, PriorBodies | None]:
    gravity = ",".join(str(each) for each in wanted.gravity) if wanted.gravity else None
    gains = [str(joint.gain) for joint in wanted.joints if joint.gain is not None]
    missing = next((place for place, joint in enumerate(wanted.joints) if joint.gain is None), None)
    if missing is not None and (file is None or gains):
        raise InputError(f"joints.{missing}.gain: is missing; joint torque for one unit of command")
    if file is not None:
        made, prior = urdf_robot(file, wanted.tip, gravity, gains or None, table.scalars)
        if len(made.joints) != len(wanted.joints):
            names = ", ".join(joint.name for joint in made.joints)
            raise InputError(
                f"joints: {len(wanted.joints)} given; the robot of {file.name} has {len(made.joints)}: {names}"
            )
        return made, prior
    if gravity is None:
        raise InputError("gravity: is missing; gravity in the base frame, x, y, z in m/s²")
    names = [joint.name or f"j{place}" for place, joint in enumerate(wanted.joints, start=1)]
    frames = [",".join(str(each) for each in joint.dh) for joint in wanted.joints]
    kinds: list[str] = [joint.type for joint in wanted.joints]
    return typed_robot(table.scalars, kinds, gains, names, frames, gravity, _nobody_asked), None


def _nobody_asked(option: str, what: str) -> str:
    raise InputError(f"{option}: is missing; {what}")


def _description(table: ForeignTable) -> RecordDescription:
    names = [column.name for column in table.columns]
    shown = [
        _column(column, name if name and names.count(name) == 1 else f"#{place}")
        for place, (column, name) in enumerate(zip(table.columns, names, strict=True), start=1)
    ]
    roles = guess_roles(table)
    return RecordDescription(
        file=table.path.name,
        decided=list(table.remarks),
        columns=shown[:MOST_COLUMNS],
        left_off=max(len(shown) - MOST_COLUMNS, 0),
        numbers={name: value for name, value in table.scalars.items() if np.isfinite(value)},
        time=roles.time,
        rate=None if table.period is None else 1 / table.period.seconds,
        position=list(roles.position),
        command=list(roles.command),
    )


def _column(column: ForeignColumn, name: str) -> RecordColumn:
    unit = column.unit.name if column.unit else None
    if column.numbers is None:
        cells = column.words or ()
        first = next((cell for cell in cells if cell), "")[:40]
        return RecordColumn(
            name=name, unit=unit, samples=len(cells), smallest=None, largest=None, first=first, outline=[]
        )
    values = np.asarray(column.numbers, dtype=np.float64)
    finite = values[np.isfinite(values)]
    return RecordColumn(
        name=name,
        unit=unit,
        samples=len(values),
        smallest=float(finite.min()) if len(finite) else None,
        largest=float(finite.max()) if len(finite) else None,
        first=f"{values[0]:.12g}" if len(values) else "",
        outline=_outline(values),
    )


def _outline(values: np.ndarray) -> list[float | None]:
    """Smallest and largest value of each of some blocks, in turn; of few samples these themselves."""
    if len(values) <= 2 * OUTLINE_BLOCKS:
        return [float(value) if np.isfinite(value) else None for value in values]
    outline: list[float | None] = []
    for block in np.array_split(values, OUTLINE_BLOCKS):
        finite = block[np.isfinite(block)]
        outline += [float(finite.min()), float(finite.max())] if len(finite) else [None, None]
    return outline
