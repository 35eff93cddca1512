"""Which kind of file a foreign file is, told by its first bytes before its name."""

from __future__ import annotations

import gzip
import zlib
from pathlib import Path

from identify.recording.csv_mistakes import is_gzip, unpacked
from identify.recording.errors import InputError
from identify.recording.foreign.csv_dialect import CsvOptions
from identify.recording.foreign.mdf import is_mdf, read_mdf
from identify.recording.foreign.rosbag import is_rosbag, read_rosbag
from identify.recording.foreign.table import ForeignTable

HDF5 = b"\x89HDF"
"""How an HDF5 file begins; a MAT file of version 7.3 has a header of 512 bytes before it."""


def read_foreign(path: Path, options: CsvOptions | None = None, topic: str | None = None) -> ForeignTable:
    """Read a table in text of any dialect (plain or gzip), a MAT file of any version, Parquet, MDF, or a recording of ROS.

    topic : of a recording of ROS, whose joints are the robot's

    Raises InputError: the file cannot be read or holds no column of numbers; names what would help.
    """
    if not path.exists():
        raise InputError(f"{path}: there is no such file")
    try:
        start = b""
        if path.is_file():
            with path.open("rb") as stream:
                start = stream.read(520)
            if not start:
                raise InputError(f"{path}: is empty")
            if is_gzip(path):
                _refuse_packed(path)
        if is_rosbag(path, start):
            return read_rosbag(path, topic)
        if topic is not None:
            raise InputError(f"--topic: {path} is no recording of ROS; leave it out")
        if path.is_dir():
            raise InputError(f"{path}: is a folder; give a file")
        if is_mdf(start):
            return read_mdf(path)
        if start.startswith(b"PAR1"):
            from identify.recording.foreign.parquet import read_parquet

            return read_parquet(path)
        if HDF5 in (start[:4], start[512:516]):
            from identify.recording.foreign.matlab import read_hdf5

            return read_hdf5(path)
        if path.suffix.lower() == ".mat" or start.startswith(b"MATLAB"):
            from identify.recording.foreign.matlab import read_mat

            return read_mat(path)
        from identify.recording.foreign.csv_table import read_csv

        return read_csv(path, options or CsvOptions())
    except OSError as error:
        raise InputError(f"{path}: cannot be read: {error.strerror or error}") from None


def _refuse_packed(path: Path) -> None:
    """Refuse a gzip file of anything but text, which alone is read packed."""
    try:
        with unpacked(path) as stream:
            start = stream.read(520)
    except (EOFError, zlib.error, gzip.BadGzipFile):
        return  # said where it is read
    binary = start.startswith((b"PAR1", b"MATLAB", b"PK")) or HDF5 in (start[:4], start[512:516])
    if binary or is_mdf(start) or is_rosbag(path, start):
        raise InputError(
            f"{path}: is packed by gzip, which is read of tables in text alone; unpack it: gunzip {path.name}"
        )
