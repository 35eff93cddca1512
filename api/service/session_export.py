"""A measured session as a file of SI units for other programs: MAT (version 5), Parquet, HDF5.

All have the same columns under the names of the CSV form (t, q1 …, v1 …, ext1 …, temp1 …), one value for each sample, and
the unit of each: in MAT a struct `units`, in Parquet the metadata of the field, in HDF5 the attribute `unit`. Experiment,
session, payload and drive gain stand beside them.
"""

import json
import os
import tempfile
from collections.abc import Iterator
from dataclasses import dataclass
from enum import StrEnum
from pathlib import Path
from typing import Any

import h5py
import numpy as np
from numpy.typing import NDArray

from identify.recording import ExperimentFile, Session
from identify.recording.experiment import experiment_from
from identify.recording.experiment_file import EXPERIMENT_FILE

COMMAND_UNIT = "unit that drive_gain expects"


BLOCK = 1 << 20
"""Bytes sent at a time."""


class SessionFormat(StrEnum):
    """Files that a session is written to, as requests name them."""

    MAT = "mat"
    PARQUET = "parquet"
    HDF5_SI = "hdf5-si"

    @property
    def ending(self) -> str:
        """Of the file's name."""
        return ".si.h5" if self is SessionFormat.HDF5_SI else f".{self.value}"

    @property
    def media_type(self) -> str:
        """Of the answer."""
        return {
            SessionFormat.MAT: "application/x-matlab-data",
            SessionFormat.PARQUET: "application/vnd.apache.parquet",
            SessionFormat.HDF5_SI: "application/x-hdf5",
        }[self]


@dataclass(frozen=True)
class SessionTable:
    """The columns of a session, each with its unit, and what is said of all of them.

    columns : name -> (N,), SI, joint space
    units   : name -> unit
    about   : experiment, session, payload (kg), joints
    gain    : (n, n) joint torque = gain @ v, N m or N per unit of v
    """

    columns: dict[str, NDArray[np.float64]]
    units: dict[str, str]
    about: dict[str, str]
    gain: NDArray[np.float64]

    @classmethod
    def of(cls, declared: ExperimentFile, session: Session) -> "SessionTable":
        """The table of a session of the experiment."""
        gain = experiment_from(declared, session.entry.path.with_name(EXPERIMENT_FILE)).drive_gain
        joints = declared.robot.joints
        columns, units = {"t": session.time}, {"t": "s"}
        groups: list[tuple[str, NDArray[np.float64] | None, list[str]]] = [
            ("q", session.position, ["rad" if joint.revolute else "m" for joint in joints]),
            ("v", session.command, [COMMAND_UNIT for _ in joints]),
            ("ext", session.external, ["N m" if joint.revolute else "N" for joint in joints]),
            ("temp", session.temperature, ["degC" for _ in joints]),
        ]
        for name, values, of_joints in groups:
            for index, unit in enumerate(of_joints):
                if values is not None:
                    columns[f"{name}{index + 1}"] = np.ascontiguousarray(values[:, index])
                    units[f"{name}{index + 1}"] = unit
        about = {
            "experiment": declared.name,
            "session": session.entry.file,
            "payload": session.entry.payload.name,
            "payload_mass_kg": repr(session.entry.payload.mass),
            "joints": json.dumps([joint.name for joint in joints], ensure_ascii=False),
        }
        return cls(columns, units, about, gain)

    def sent(self, form: SessionFormat, scratch: Path) -> tuple[int, Iterator[bytes]]:
        """The file's size in bytes, and its content block by block; on the disk it has no name, and goes with the reader.

        scratch : an existing folder in which it is written
        """
        with tempfile.TemporaryDirectory(dir=scratch) as place:
            file = Path(place) / f"session{form.ending}"
            self.write(file, form)
            stream = file.open("rb")

        def blocks() -> Iterator[bytes]:
            with stream:
                while block := stream.read(BLOCK):
                    yield block

        return os.fstat(stream.fileno()).st_size, blocks()

    def write(self, target: Path, form: SessionFormat) -> None:
        """Write the file."""
        {
            SessionFormat.MAT: self._write_mat,
            SessionFormat.PARQUET: self._write_parquet,
            SessionFormat.HDF5_SI: self._write_hdf5,
        }[form](target)

    def _write_mat(self, target: Path) -> None:
        from scipy.io import savemat  # pyright: ignore[reportMissingTypeStubs, reportUnknownVariableType]

        columns = {name: values[:, None] for name, values in self.columns.items()}
        beside = {"units": self.units, "about": self.about, "drive_gain": self.gain}
        savemat(target, {**columns, **beside}, appendmat=False, do_compression=True)

    def _write_parquet(self, target: Path) -> None:
        import pyarrow  # pyright: ignore[reportMissingTypeStubs]
        from pyarrow import parquet  # pyright: ignore[reportMissingTypeStubs]

        arrow: Any = pyarrow
        fields = [
            arrow.field(name, arrow.float64(), metadata={"unit": self.units[name]}) for name in self.columns
        ]
        about = self.about | {"drive_gain": json.dumps(self.gain.tolist())}
        schema = arrow.schema(fields, metadata=about)
        table = arrow.table(list(self.columns.values()), schema=schema)
        write: Any = parquet
        write.write_table(table, target)

    def _write_hdf5(self, target: Path) -> None:
        with h5py.File(target, "x") as file:
            for name, values in self.columns.items():
                data = file.create_dataset(name, data=values, compression="gzip")
                data.attrs["unit"] = self.units[name]
            file.attrs.update(self.about)
            file.attrs["drive_gain"] = self.gain
