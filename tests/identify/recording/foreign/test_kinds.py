"""Which reader a foreign file goes to: by its first bytes, whatever its name says."""

from __future__ import annotations

import gzip
import io

import h5py
import numpy as np
import pytest
import scipy.io

from identify.recording.errors import InputError
from identify.recording.foreign.kinds import read_foreign

TABLE = "t,q1\n" + "".join(f"{k / 100},{k}\n" for k in range(30))


def mat(path):
    scipy.io.savemat(path, {"t": np.arange(30.0), "q1": np.arange(30.0)})


def hdf5(path):
    with h5py.File(path, "w") as file:
        file["t"], file["q1"] = np.arange(30.0), np.arange(30.0)


def mat_of_version_7_3(path):
    with h5py.File(path, "w", userblock_size=512) as file:
        file["t"], file["q1"] = np.arange(30.0), np.arange(30.0)
    with path.open("r+b") as stream:
        stream.write(b"MATLAB 7.3 MAT-file".ljust(124) + b"\x00\x02IM")


def parquet(path):
    pyarrow = pytest.importorskip("pyarrow")
    from pyarrow import parquet as writer

    writer.write_table(pyarrow.table({"t": np.arange(30.0), "q1": np.arange(30.0)}), path)


@pytest.mark.parametrize("make", [mat, hdf5, mat_of_version_7_3, parquet])
def test_a_file_is_told_by_its_first_bytes_and_not_by_its_name(tmp_path, make):
    path = tmp_path / "log.csv"
    buffer = tmp_path / "made"
    made = tmp_path / "made.mat" if make is mat else buffer
    make(made)
    path.write_bytes(made.read_bytes())
    read = read_foreign(path)
    assert read.column("q1", "test").numbers.tolist() == list(range(30))


def test_text_is_a_table_plain_or_packed(tmp_path):
    (tmp_path / "a.csv").write_text(TABLE)
    (tmp_path / "b").write_bytes(gzip.compress(TABLE.encode()))
    for name in ("a.csv", "b"):
        read = read_foreign(tmp_path / name)
        assert read.column("q1", "test").numbers.tolist() == list(range(30))


def packed(content):
    buffer = io.BytesIO()
    with gzip.GzipFile(fileobj=buffer, mode="wb") as stream:
        stream.write(content)
    return buffer.getvalue()


@pytest.mark.parametrize(
    "content",
    [
        b"PAR1" + bytes(600),
        b"MATLAB 5.0 MAT-file" + bytes(600),
        b"PK\x03\x04" + bytes(600),
        b"\x89HDF\r\n\x1a\n" + bytes(600),
        bytes(512) + b"\x89HDF\r\n\x1a\n",
        b"MDF     4.10" + bytes(600),
        b"#ROSBAG V2.0\n" + bytes(600),
    ],
)
def test_binary_files_that_are_packed_say_how_to_unpack_them(tmp_path, content):
    path = tmp_path / "log.gz"
    path.write_bytes(packed(content))
    with pytest.raises(InputError, match=r"log\.gz: is packed by gzip, .* unpack it: gunzip log\.gz$"):
        read_foreign(path)


def test_what_is_no_file_of_samples_is_refused_in_one_line(tmp_path):
    (tmp_path / "empty.csv").touch()
    (tmp_path / "folder").mkdir()
    (tmp_path / "a.csv").write_text(TABLE)
    for name, topic, said in (
        ("none.csv", None, r"none\.csv: there is no such file"),
        ("empty.csv", None, r"empty\.csv: is empty"),
        ("folder", None, r"folder: is a folder; give a file"),
        ("a.csv", "/joint_states", r"--topic: .*a\.csv is no recording of ROS; leave it out"),
    ):
        with pytest.raises(InputError, match=said):
            read_foreign(tmp_path / name, topic=topic)
