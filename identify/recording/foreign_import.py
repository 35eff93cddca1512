"""An experiment made of other people's measurements: which column is what, units, gains."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from identify.recording.errors import InputError
from identify.recording.experiment import Experiment, load_experiment
from identify.recording.experiment_file import (
    EXPERIMENT_FILE,
    DeclaredSession,
    ExperimentFile,
    Payload,
    Robot,
    append_session,
    check_settings,
    read_experiment_file,
    write_experiment,
)
from identify.recording.foreign import ForeignTable
from identify.recording.sampling import SHORTEST_SEGMENT
from identify.recording.session_csv import write_csv_session

Array = NDArray[np.float64]

TIME_UNITS = {"s": 1.0, "ms": 1e-3, "us": 1e-6, "ns": 1e-9}
POSITION_UNITS = {
    "rad": 1.0,
    "deg": np.pi / 180,
    "mrad": 1e-3,
    "turn": 2 * np.pi,
    "m": 1.0,
    "mm": 1e-3,
    "um": 1e-6,
}
COMMAND_UNITS = {"A": 1.0, "mA": 1e-3, "V": 1.0, "mV": 1e-3, "Nm": 1.0, "N": 1.0, "percent": 1.0}
"""What a drive gain may count in; only the parts of a unit change the numbers."""


@dataclass(frozen=True)
class ColumnMap:
    """Which columns of a foreign file are what, joint by joint."""

    position: tuple[str, ...]
    command: tuple[str, ...]
    time: str | None = None
    """None: the samples are uniform, `rate` of them a second."""
    rate: float | None = None
    """Hz"""
    time_unit: str = "s"
    position_unit: tuple[str, ...] = ("rad",)
    """One for all joints, or one for each; a name of `POSITION_UNITS`, or a number: rad (m) for one unit."""
    command_unit: tuple[str, ...] = ("A",)
    external: tuple[str, ...] = ()
    temperature: tuple[str, ...] = ()
    extra: tuple[str, ...] = ()
    """Columns to keep beside."""


def factors(units: tuple[str, ...], known: dict[str, float], n: int, option: str) -> Array:
    """(n,): what each joint's column is multiplied by.

    :raises InputError: a unit is not known, or their number fits neither one nor n.
    """
    if len(units) not in (1, n):
        raise InputError(f"{option}: {len(units)} units for {n} joints; give one, or {n}")
    found = []
    for unit in units:
        try:
            value = known[unit] if unit in known else float(unit)
        except ValueError:
            raise InputError(
                f"{option}: '{unit}' is not known; use {', '.join(known)}, or a number"
            ) from None
        if not np.isfinite(value) or value == 0:
            raise InputError(f"{option}: '{unit}' must be a finite number other than 0")
        found.append(value)
    return np.array(found * (n // len(found)))


def import_session(
    table: ForeignTable,
    columns: ColumnMap,
    folder: Path,
    session_file: str,
    payload: Payload,
    role: str,
    robot: Robot | None,
    name: str,
) -> Experiment:
    """Write a session and the experiment that declares it; with `robot` None it is added to the experiment
    there.

    Nothing is left behind if something is wrong.

    :raises InputError: names the file and column, or the option.
    """
    n = len(columns.position)
    target = folder / session_file
    made = not folder.exists()
    if target.exists():
        raise InputError(f"{target}: is there already; choose another name for the session")
    if robot is not None and (folder / EXPERIMENT_FILE).exists():
        raise InputError(f"{folder / EXPERIMENT_FILE}: is there already; use --append to add a session to it")
    joints = len((robot or read_experiment_file(folder / EXPERIMENT_FILE).robot).joints)
    if joints != n or len(columns.command) != n:
        raise InputError(
            f"{table.path}: {n} position and {len(columns.command)} command columns for {joints} joints; give one of"
            " each for every joint"
        )
    time, position, command = _measured(table, columns, n)
    external, temperature = (
        _stack(table, names, kind, len(time)) if names else None
        for names, kind in ((columns.external, "external force"), (columns.temperature, "temperature"))
    )
    extra = {
        column.replace(":", "_"): _column(table, column, "an extra column", len(time))
        for column in columns.extra
    }
    declared = {"file": session_file, "payload": payload.name, "role": role}
    session = check_settings(DeclaredSession, declared, {}, "options: session")
    try:
        folder.mkdir(parents=True, exist_ok=True)
    except FileExistsError:
        raise InputError(f"--out {folder}: is a file; give a folder") from None
    except OSError as error:
        raise InputError(f"--out {folder}: cannot be written: {error.strerror or error}") from None
    try:
        write_csv_session(target, time, position, command, external, temperature, extra)
        if robot is None:
            append_session(folder, session, payload)
        else:
            experiment = ExperimentFile(
                format=1, name=name, robot=robot, payloads=(payload,), sessions=(session,)
            )
            write_experiment(folder, experiment)
        return load_experiment(folder)
    except BaseException as error:
        target.unlink(missing_ok=True)
        if made and not any(folder.iterdir()):
            folder.rmdir()
        if isinstance(error, OSError):
            raise InputError(f"--out {folder}: cannot be written: {error.strerror or error}") from None
        raise


def _measured(table: ForeignTable, columns: ColumnMap, n: int) -> tuple[Array, Array, Array]:
    length = len(table.column(columns.position[0], "the position of joint 1"))
    if length < SHORTEST_SEGMENT:
        raise InputError(
            f"{table.path}: '{columns.position[0]}' has {length} samples; that is too few for a session"
        )
    position = _stack(table, columns.position, "position", length)
    command = _stack(table, columns.command, "command", length)
    position = position * factors(columns.position_unit, POSITION_UNITS, n, "--position-unit")
    command = command * factors(columns.command_unit, COMMAND_UNITS, n, "--command-unit")
    if columns.time is None:
        if columns.rate is None or not columns.rate > 0:
            raise InputError(f"{table.path}: no time column; give --time COLUMN, or --rate HZ above 0")
        return np.arange(length) / columns.rate, position, command
    unit = factors((columns.time_unit,), TIME_UNITS, 1, "--time-unit")[0]
    time = _column(table, columns.time, "time", length) * unit
    if (np.diff(time) <= 0).any():
        row = int(np.argmax(np.diff(time) <= 0)) + 2
        raise InputError(f"{table.path}: column '{columns.time}', sample {row}: time does not increase")
    return time, position, command


def _stack(table: ForeignTable, names: tuple[str, ...], kind: str, length: int) -> Array:
    columns = [
        _column(table, name, f"the {kind} of joint {j}", length) for j, name in enumerate(names, start=1)
    ]
    return np.stack(columns, axis=1)


def _column(table: ForeignTable, name: str, used_for: str, length: int) -> Array:
    values = table.column(name, used_for)
    if len(values) != length:
        raise InputError(
            f"{table.path}: column '{name}' has {len(values)} samples, the first position {length}"
        )
    if not np.isfinite(values).all():
        sample = int(np.argmin(np.isfinite(values))) + 1
        raise InputError(f"{table.path}: column '{name}', sample {sample}: not a finite number")
    return values
