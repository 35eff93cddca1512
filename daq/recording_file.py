"""The file of a session: HDF5 in SWMR mode by the layout of docs/architecture.md, readable while it grows.

After a kill every flushed row is there. HDF5 without SWMR, Parquet and MF4 lose the whole file.
"""

import json
import os
import platform
import shutil
from dataclasses import dataclass, field
from datetime import UTC, datetime
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path
from typing import Any, Self

import h5py
import numpy as np
from numpy.typing import NDArray
from pydantic import BaseModel, ConfigDict

from daq.json_object import JsonObject
from daq.rig import Rig
from identify.recording.controller_file import ControllerFile
from identify.recording.experiment_file import Payload
from identify.recording.session_hdf5 import (
    COMMAND,
    CONTROLLER,
    CYCLE,
    FORMAT,
    POSITION,
    SETPOINT,
    SYNC_TIME,
    TEMPERATURE,
    VALID,
)

_CHUNK_ROWS = 2048
_CACHED_CHUNKS = 4
"""of each column in memory: rows are appended and never read again, but HDF5 2 would keep 8 MB of every column"""


@dataclass(frozen=True)
class SessionDescription:
    """Everything that is needed to read a recording in ten years, beside the samples."""

    rig: Rig
    plan: JsonObject
    payload: Payload
    operator: str
    clock_source: str
    role: str = "identification"
    weighed_mass: float | None = None
    """kg, as the scale or the operator said"""
    started: datetime = field(default_factory=lambda: datetime.now(UTC))
    remarks: tuple[str, ...] = ()
    controllers: ControllerFile | None = None
    """of the drives, as they said before the session; None where they were not asked, or did not say"""

    def attributes(self) -> JsonObject:
        """The attributes of the file's root."""
        gains = {} if self.controllers is None else {CONTROLLER: self.controllers.model_dump_json()}
        return {
            **gains,
            "format": FORMAT,
            "software_version": software_version(),
            "rig": self.rig.model_dump_json(),
            "plan": json.dumps(self.plan),
            "payload": self.payload.model_dump_json(),
            "operator": self.operator,
            "host": platform.node(),
            "started": self.started.isoformat(timespec="milliseconds"),
            "clock_source": self.clock_source,
            "cycle": self.rig.cycle,
            "role": self.role,
            "weighed_mass": np.nan if self.weighed_mass is None else self.weighed_mass,
            "remarks": json.dumps(self.remarks, ensure_ascii=False),
        }


def software_version() -> str:
    """Version of this software, as installed or from its source tree."""
    try:
        return version("coulomb")
    except PackageNotFoundError:
        return "source"


class RecorderProcess(BaseModel):
    """What tells a running recorder from one that is gone."""

    model_config = ConfigDict(frozen=True)

    host: str
    process: int
    """its number"""
    started: int
    """clock ticks from the computer's start"""

    @classmethod
    def this(cls) -> Self:
        """The present process."""
        return cls(host=platform.node(), process=os.getpid(), started=process_started(os.getpid()))

    @property
    def runs(self) -> bool:
        """Whether it does, on this computer."""
        return self.host == platform.node() and process_started(self.process) == self.started != 0


def process_started(process: int) -> int:
    """Clock ticks from the computer's start to that of a process; 0 where there is none (any more)."""
    try:
        fields = Path(f"/proc/{process}/stat").read_text().rpartition(")")[2].split()
    except OSError:
        return 0
    return 0 if fields[0] == "Z" else int(fields[19])


class RecordingFile:
    """A session that is being recorded.

    path : the file, created
    """

    def __init__(self, path: Path, description: SessionDescription) -> None:
        self.path = path
        self.rows = 0
        rig = description.rig
        n = len(rig.axes)
        # The latest format is what SWMR needs; it also lifts the limit of 64 kB on the plan's attribute.
        self._file = h5py.File(
            path, "x", libver="latest", rdcc_nbytes=_CACHED_CHUNKS * _CHUNK_ROWS * 8 * max(1, n)
        )
        root = self._file
        for name, value in description.attributes().items():
            root.attrs[name] = value
        root.attrs["recorder"] = RecorderProcess.this().model_dump_json()
        root.attrs["counters"] = "{}"
        root.attrs["status"] = "recording"
        root.attrs["status_reason"] = ""
        self._columns = {
            CYCLE: self._create(CYCLE, (), np.int64),
            SYNC_TIME: self._create(SYNC_TIME, (), np.int64),
            POSITION: self._create(POSITION, (n,), np.int32),
            COMMAND: self._create(COMMAND, (n,), np.int32),
            SETPOINT: self._create(SETPOINT, (n,), np.int32),
            VALID: self._create(VALID, (n,), np.uint8),
        }
        self._columns[POSITION].attrs["matrix"] = rig.position_matrix
        self._columns[POSITION].attrs["offset"] = rig.position_offset
        self._columns[COMMAND].attrs["scale"] = rig.command_scale
        self._columns[COMMAND].attrs["unit"] = [p.current_reference.unit for p in rig.profiles]
        if rig.record_temperature:
            self._columns[TEMPERATURE] = self._create(TEMPERATURE, (n,), np.float32)
        self._file.swmr_mode = True
        self.flush(to_disk=True)

    def _create(self, name: str, shape: tuple[int, ...], kind: type) -> h5py.Dataset:
        return self._file.create_dataset(
            name, (0, *shape), kind, maxshape=(None, *shape), chunks=(_CHUNK_ROWS, *shape)
        )

    def append(self, rows: NDArray[Any]) -> None:
        """Append rows (M,) of `daq.samples.sample_dtype`; they are safe after the next flush.

        Raises OSError when the disk does not take them.
        """
        end = self.rows + len(rows)
        for name, column in self._columns.items():
            column.resize(end, axis=0)
            column[self.rows : end] = rows[name]
        self.rows = end

    def flush(self, to_disk: bool = False) -> None:
        """Hand all rows to the operating system (safe from a kill), with `to_disk` to the disk (from a
        power cut).

        Raises OSError when the disk does not take them.
        """
        # `cycle` is flushed last: a reader takes its length for the number of rows.
        for name in [*(name for name in self._columns if name != CYCLE), CYCLE]:
            self._columns[name].flush()
        self._file.flush()
        if to_disk:
            os.fsync(self._file.id.get_vfd_handle())

    @property
    def gone(self) -> bool:
        """Whether the file is no longer where it was made: moved, deleted, or its folder was."""
        try:
            there = os.stat(self.path)
        except OSError:
            return True
        ours = os.fstat(self._file.id.get_vfd_handle())
        return (there.st_dev, there.st_ino) != (ours.st_dev, ours.st_ino)

    def free_space(self) -> int:
        """Bytes free on the disk that holds the file, wherever it is by now."""
        state = os.fstatvfs(self._file.id.get_vfd_handle())
        return state.f_bavail * state.f_frsize

    def _written_anew(self) -> None:
        """A file that was taken away while it was being written: its content, which is there as long as it is open, is
        written to where it was made.
        """
        held = os.dup(self._file.id.get_vfd_handle())
        try:
            self._file.close()
            self.path.parent.mkdir(parents=True, exist_ok=True)
            with open(f"/proc/self/fd/{held}", "rb") as source, self.path.open("xb") as target:
                shutil.copyfileobj(source, target)
                target.flush()
                os.fsync(target.fileno())
        finally:
            os.close(held)

    def abandon(self) -> None:
        """Close the file as it is; where it was deleted, it is gone."""
        self._file.close()

    def finish(self, status: str, reason: str, counters: JsonObject, cause: str) -> None:
        """Close the file with its final status: `complete`, `aborted` or `faulted`; cause: a `StopCause`.

        Raises OSError when the disk does not take it; the file then stays as after a kill.
        """
        self.flush(to_disk=True)
        if self.gone:
            self._written_anew()
        else:
            self._file.close()
        set_status(self.path, status, reason, counters, cause)


def set_status(path: Path, status: str, reason: str, counters: JsonObject, cause: str) -> None:
    """Write the final attributes of a closed recording, and have them on disk."""
    # Without HDF5's lock: whoever reads the file at this moment would otherwise keep us from saying how it
    # ended.
    with h5py.File(path, "r+", libver="latest", locking=False) as file:
        file.attrs["status"] = status
        file.attrs["status_reason"] = reason
        file.attrs["stop_cause"] = cause
        file.attrs["counters"] = json.dumps(counters)
        file.flush()
        os.fsync(file.id.get_vfd_handle())
