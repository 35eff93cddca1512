"""Exports of a recording in SI units: CSV of the contract, MAT, Parquet. The HDF5 recording stays the truth."""

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import h5py
import numpy as np
from numpy.typing import NDArray

from daq.json_object import JsonObject
from daq.samples import joint_positions
from identify.recording.errors import InputError
from identify.recording.session_csv import write_csv_session
from identify.recording.session_hdf5 import (
    COMMAND,
    COMMAND_CAME,
    CYCLE,
    MATRIX,
    OFFSET,
    POSITION,
    SCALE,
    SETPOINT,
    SYNC_TIME,
    TEMPERATURE,
    VALID,
    setpoints_in_force,
)

FORMATS = ("csv", "csv.gz", "mat", "parquet")


@dataclass(frozen=True)
class ScaledSession:
    """All rows of a recording in SI units; NaN where nothing came."""

    time: NDArray[np.float64]
    """(N,) s from the first SYNC"""
    cycle: NDArray[np.int64]
    """(N,)"""
    position: NDArray[np.float64]
    """(N, n) rad or m"""
    command: NDArray[np.float64]
    """(N, n) A"""
    setpoint: NDArray[np.float64]
    """(N, n) rad or m, in force when the drives sampled the row; the recording has what was sent with its SYNC"""
    valid: NDArray[np.uint8]
    """(N, n) bits as in the recording"""
    temperature: NDArray[np.float64] | None
    """(N, n) °C"""
    attributes: JsonObject
    """of the recording: rig, plan, payload, counters, …"""

    @property
    def whole(self) -> NDArray[np.bool_]:
        """(N,) rows in which every axis's position and command came."""
        came = np.isfinite(np.concatenate([self.position, self.command], axis=1))
        return np.asarray(came.all(axis=1))


def scaled_session(path: Path) -> ScaledSession:
    """Read a recording and scale its counts.

    Raises InputError where the file is no recording.
    """
    try:
        with h5py.File(path, "r", libver="latest", swmr=True) as file:
            column = {str(name): item for name, item in file.items() if isinstance(item, h5py.Dataset)}
            matrix = np.asarray(column[POSITION].attrs[MATRIX], dtype=float)
            offset = np.asarray(column[POSITION].attrs[OFFSET], dtype=float)
            rows = min(len(column[name]) for name in (CYCLE, SYNC_TIME, POSITION, COMMAND, SETPOINT, VALID))
            valid = np.asarray(column[VALID][:rows])
            position = joint_positions(column[POSITION][:rows], valid, matrix, offset)
            command = column[COMMAND][:rows] * np.asarray(column[COMMAND].attrs[SCALE], dtype=float)
            command[(valid & COMMAND_CAME) == 0] = np.nan
            stamp = np.asarray(column[SYNC_TIME][:rows])
            temperature = column.get(TEMPERATURE)
            return ScaledSession(
                time=(stamp - stamp[0]) * 1e-9 if rows else np.empty(0),
                cycle=np.asarray(column[CYCLE][:rows]),
                position=position,
                command=command,
                setpoint=setpoints_in_force(column[SETPOINT][:rows] @ matrix.T + offset),
                valid=valid,
                temperature=None if temperature is None else np.asarray(temperature[:rows], dtype=float),
                attributes=dict(file.attrs),
            )
    except (OSError, KeyError) as error:
        raise InputError(f"{path}: cannot be read as a recording ({error})") from None


def export_session(recording: Path, target: Path) -> int:
    """Write a recording in the format that the target's name ends in; the number of rows written.

    The CSV holds the rows in which everything came, since the contract knows no gaps within a row; MAT and Parquet
    hold all rows, NaN where nothing came.

    Raises InputError for another ending, a file that is there already, a folder that is not, or no recording.
    """
    writer = next((write for end, write in _WRITERS.items() if target.name.lower().endswith(f".{end}")), None)
    if writer is None:
        raise InputError(f"{target}: the name must end in .{', .'.join(FORMATS)}")
    if target.exists():
        raise InputError(f"{target}: already exists; remove it or choose another name")
    if not target.parent.is_dir():
        raise InputError(f"{target}: there is no folder {target.parent}")
    session = scaled_session(recording)
    # A half-written export must not look like a whole one.
    partial = target.with_name(f".partial-{target.name}")
    try:
        rows = writer(session, partial)
        partial.replace(target)
    finally:
        partial.unlink(missing_ok=True)
    return rows


def _write_csv(session: ScaledSession, target: Path) -> int:
    whole = session.whole
    temperature = session.temperature
    if temperature is not None and np.isnan(temperature[whole]).any():
        temperature = None
    n = session.position.shape[1]
    extra = {"cycle": session.cycle[whole]}
    extra |= {f"qref{axis + 1}": session.setpoint[whole, axis] for axis in range(n)}
    write_csv_session(
        target,
        session.time[whole],
        session.position[whole],
        session.command[whole],
        temperature=None if temperature is None else temperature[whole],
        extra=extra,
    )
    return int(whole.sum())


def _write_mat(session: ScaledSession, target: Path) -> int:
    from scipy.io import savemat  # pyright: ignore[reportMissingTypeStubs, reportUnknownVariableType]

    columns = {
        "t": session.time[:, None],
        "cycle": session.cycle[:, None],
        "q": session.position,
        "v": session.command,
        "qref": session.setpoint,
        "valid": session.valid,
    }
    if session.temperature is not None:
        columns["temp"] = session.temperature
    texts = {name: str(value) for name, value in session.attributes.items() if isinstance(value, str)}
    savemat(target, {**columns, "recording": texts}, appendmat=False, do_compression=True)
    return len(session.time)


def _write_parquet(session: ScaledSession, target: Path) -> int:
    import pyarrow  # pyright: ignore[reportMissingTypeStubs]
    from pyarrow import parquet  # pyright: ignore[reportMissingTypeStubs]

    n = session.position.shape[1]
    columns: JsonObject = {"t": session.time, "cycle": session.cycle}
    groups = {"q": session.position, "v": session.command, "qref": session.setpoint, "valid": session.valid}
    if session.temperature is not None:
        groups["temp"] = session.temperature
    for name, values in groups.items():
        columns |= {f"{name}{axis + 1}": np.ascontiguousarray(values[:, axis]) for axis in range(n)}
    texts = {name: str(value) for name, value in session.attributes.items()}
    table: Any = pyarrow.table(columns)  # pyright: ignore[reportUnknownMemberType, reportUnknownVariableType]
    parquet.write_table(table.replace_schema_metadata(texts), target)  # pyright: ignore[reportUnknownMemberType]
    return len(session.time)


_WRITERS: dict[str, Callable[[ScaledSession, Path], int]] = {
    "csv": _write_csv,
    "csv.gz": _write_csv,
    "mat": _write_mat,
    "parquet": _write_parquet,
}
