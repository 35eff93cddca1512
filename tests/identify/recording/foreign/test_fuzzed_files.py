"""Damaged files end in a session or in one line of words, never in a traceback."""

import os
import random
import struct
import zlib
from pathlib import Path

import h5py
import numpy as np
import pyarrow
import pytest
from pyarrow import parquet
from scipy.io import savemat

from identify.recording import InputError
from identify.recording.foreign import ColumnMap, measure, read_foreign
from identify.recording.foreign.roles import named_roles
from tests.api.recordings_of_ros import joint_state, write_bag

FILES = int(os.environ.get("COULOMB_FUZZED_FILES", "150"))
"""Damaged files of each kind; of those with objects of MATLAB, which take longest, a third."""


def damaged(content, chance):
    """A file with bytes changed, cut out, doubled, or its end lost."""
    data = bytearray(content)
    for _ in range(chance.choice((1, 2, 5, 30))):
        place = chance.randrange(len(data))
        kind = chance.randrange(5)
        if kind == 0:
            data[place] = chance.randrange(256)
        elif kind == 1:
            del data[place : place + chance.randrange(1, 40)]
        elif kind == 2:
            data[place:place] = data[place : place + chance.randrange(1, 200)]
        elif kind == 3:
            data[place:place] = bytes(chance.randrange(256) for _ in range(chance.randrange(1, 9)))
        else:
            data[place:place] = chance.choice(
                (b",", b";", b'"', b"\n", b"\r", b"\x00", b"\xff\xfe", b"-", b"e", b"1,5", b"\t")
            )
        if not data:
            return b""
    return bytes(data[: chance.randrange(len(data))] if chance.random() < 0.1 else data)


def csv_file(folder):
    rows = [f"{k / 500:.3f};{np.sin(k / 50):.6f};{np.cos(k / 40):.5f}".replace(".", ",") for k in range(80)]
    return ("Recorder\r\n\r\nt;q [deg];i\r\n" + "\r\n".join(rows)).encode("cp1252")


def mat_file(folder):
    time = np.arange(80) / 500
    savemat(
        folder / "whole.mat", {"t": time, "q": np.sin(time), "i": {"value": np.cos(time), "name": "current"}}
    )
    return (folder / "whole.mat").read_bytes()


def hdf5_file(folder):
    time = np.arange(80) / 500
    with h5py.File(folder / "whole.h5", "w", userblock_size=512) as file:
        for name, values in (("t", time), ("q", np.sin(time)), ("i/value", np.cos(time))):
            file[name] = values[None]
    content = (folder / "whole.h5").read_bytes()
    return b"MATLAB 7.3 MAT-file".ljust(124) + b"\x00\x02IM" + content[128:]


def parquet_file(folder):
    time = np.arange(80) / 500
    table = pyarrow.table({"t": time, "q": np.sin(time), "i": [{"value": value} for value in np.cos(time)]})
    parquet.write_table(table, folder / "whole.parquet")
    return (folder / "whole.parquet").read_bytes()


def recording_file(folder):
    states = (
        (time, joint_state(time, ["q"], [np.sin(time)], [np.cos(time)])) for time in np.arange(80) / 500
    )
    return next(write_bag(folder / "bag", "mcap", {"/joint_states": states}).glob("*.mcap")).read_bytes()


def objects_of_version_5(_folder):
    """Structs, tables, timetables and a time series, unpacked, so that a changed byte changes what they say."""
    packed = (FOLDER / "objects-v7.mat").read_bytes()
    (objects_at,) = struct.unpack("<Q", packed[116:124])
    whole, at = bytearray(packed[:128]), 128
    while at < len(packed):
        kind, size = struct.unpack("<II", packed[at : at + 8])
        element = packed[at : at + 8 + size]
        if at == objects_at:
            whole[116:124] = struct.pack("<Q", len(whole))
        whole += zlib.decompress(element[8:]) if kind == COMPRESSED else element
        at += 8 + size
    return bytes(whole)


def objects_of_version_7_3(_folder):
    """The same in HDF5."""
    return (FOLDER / "objects-v7.3.mat").read_bytes()


FOLDER = Path(__file__).parent / "files"
COMPRESSED = 15
"""Type of a packed data element of a MAT file."""


def altered(content, chance):
    """A file of the same length with a few bytes changed, which mostly is still one."""
    data = bytearray(content)
    for _ in range(chance.choice((1, 2, 5, 30))):
        place = chance.randrange(128, len(data))
        data[place] = chance.choice((chance.randrange(256), data[place] ^ (1 << chance.randrange(8)), 0, 255))
    return bytes(data)


OBJECTS = (
    ColumnMap(("T.q",), ("T.i",), "T.t"),
    ColumnMap(("ts.Data",), ("TT.q",), "ts.Time"),
    ColumnMap(("s.a.b",), ("T.i",), None, 500.0),
)


@pytest.mark.parametrize("make", [objects_of_version_5, objects_of_version_7_3])
def test_altered_objects_of_matlab_are_read_or_refused_in_one_line(tmp_path, make):
    whole = make(tmp_path)
    chance = random.Random(20)
    path: Path = tmp_path / "log.mat"
    refused: list[str] = []
    read = 0
    for number in range(FILES // 3):
        path.write_bytes(altered(whole, chance))
        try:
            table = read_foreign(path)
            wanted = OBJECTS[number % len(OBJECTS)]
            read += all(table.has(name) for name, _role in named_roles(wanted))
            measure(table, wanted, [False], "drop")
        except InputError as error:
            refused.append(str(error))
    assert read > FILES // 12, "too few of them got as far as columns"
    assert refused
    assert not [words for words in refused if "\n" in words or len(words) > 1500]


COLUMNS = {
    "csv": ColumnMap(("q",), ("i",), "t"),
    "mat": ColumnMap(("q",), ("i.value",), "t"),
    "parquet": ColumnMap(("q",), ("i.value",), "t"),
    "mcap": ColumnMap(("q.position",), ("q.effort",), "time"),
}


@pytest.mark.parametrize(
    ("make", "ending"),
    [
        (csv_file, "csv"),
        (mat_file, "mat"),
        (hdf5_file, "mat"),
        (parquet_file, "parquet"),
        (recording_file, "mcap"),
    ],
)
def test_a_damaged_file_is_read_or_refused_in_one_line(tmp_path, make, ending):
    whole = make(tmp_path)
    chance = random.Random(14)
    path: Path = tmp_path / f"log.{ending}"
    refused: list[str] = []
    for _ in range(FILES):
        path.write_bytes(damaged(whole, chance))
        try:
            table = read_foreign(path)
            measure(table, COLUMNS[ending], [False], "drop")
        except InputError as error:
            refused.append(str(error))
    assert 0 < len(refused) < FILES
    assert not [words for words in refused if "\n" in words or len(words) > 1500]
