"""Sessions in SI units are read back by the programs that they are for: SciPy (MAT), pyarrow (Parquet), h5py."""

import json

import h5py
import numpy as np
import pytest
import scipy.io
from pyarrow import parquet

from api.service.session_export import SessionFormat, SessionTable
from identify.recording import Session, load_experiment
from identify.recording.experiment_file import read_experiment_file

N = 50
YAML = """format: 1
name: Prüfstand
robot:
  gravity: [0.0, 0.0, -9.81]
  joints: [{name: hinge, type: revolute}, {name: slide, type: prismatic}]
  drive_gain_matrix: [[2.0, 0.5], [0.0, 3.0]]
payloads: [{name: disk, mass: 3.4584}]
sessions: [{file: session-00.csv, payload: disk}]
"""


@pytest.fixture(scope="module")
def table(tmp_path_factory) -> SessionTable:
    folder = tmp_path_factory.mktemp("measured")
    time = np.arange(N) * 0.01
    values = {
        "t": time,
        "q1": np.sin(time),
        "q2": 0.1 * np.cos(time),
        "v1": time**2,
        "v2": -time,
        "ext1": 0 * time,
        "ext2": 1 + time,
        "temp1": 20 + time,
        "temp2": 21 + time,
    }
    np.savetxt(
        folder / "session-00.csv",
        np.column_stack(list(values.values())),
        delimiter=",",
        header=",".join(values),
        comments="",
        fmt="%.17g",
    )
    (folder / "experiment.yaml").write_text(YAML, encoding="utf-8")
    experiment = load_experiment(folder)
    session: Session = experiment.read(experiment.sessions[0])
    made = SessionTable.of(read_experiment_file(folder / "experiment.yaml"), session)
    assert list(made.columns) == list(values)
    for name, column in values.items():
        np.testing.assert_array_equal(made.columns[name], column)
    return made


UNITS = {
    "t": "s",
    "q1": "rad",
    "q2": "m",
    "v1": "unit that drive_gain expects",
    "v2": "unit that drive_gain expects",
    "ext1": "N m",
    "ext2": "N",
    "temp1": "degC",
    "temp2": "degC",
}


def test_mat_holds_one_column_a_name_with_units_and_gain(table, tmp_path):
    table.write(tmp_path / "a.mat", SessionFormat.MAT)
    read = scipy.io.loadmat(tmp_path / "a.mat", simplify_cells=True)
    for name, column in table.columns.items():
        np.testing.assert_array_equal(read[name], column)
    assert read["units"] == UNITS
    assert read["about"]["experiment"] == "Prüfstand"
    np.testing.assert_array_equal(read["drive_gain"], [[2.0, 0.5], [0.0, 3.0]])
    assert scipy.io.loadmat(tmp_path / "a.mat")["q1"].shape == (N, 1)


def test_parquet_holds_the_unit_in_the_field(table, tmp_path):
    table.write(tmp_path / "a.parquet", SessionFormat.PARQUET)
    read = parquet.read_table(tmp_path / "a.parquet")
    assert read.column_names == list(table.columns)
    for name, column in table.columns.items():
        np.testing.assert_array_equal(read[name].to_numpy(), column)
    assert {field.name: field.metadata[b"unit"].decode() for field in read.schema} == UNITS
    assert read.schema.metadata[b"payload"] == b"disk"
    assert json.loads(read.schema.metadata[b"drive_gain"]) == [[2.0, 0.5], [0.0, 3.0]]


def test_hdf5_holds_the_unit_as_an_attribute_and_leaves_no_file_behind(table, tmp_path):
    size, blocks = table.sent(SessionFormat.HDF5_SI, tmp_path)
    assert list(tmp_path.iterdir()) == []
    content = b"".join(blocks)
    assert len(content) == size
    (tmp_path / "a.h5").write_bytes(content)
    with h5py.File(tmp_path / "a.h5") as read:
        assert {name: read[name].attrs["unit"] for name in read} == UNITS
        for name, column in table.columns.items():
            np.testing.assert_array_equal(read[name][:], column)
        assert read.attrs["session"] == "session-00.csv"
        assert json.loads(read.attrs["joints"]) == ["hinge", "slide"]
