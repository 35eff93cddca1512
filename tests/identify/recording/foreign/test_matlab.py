"""MAT files of any version: arrays, structs, tables, timetables and time series, written by others' writers."""

from pathlib import Path

import h5py
import numpy as np
import pytest
from scipy.io import savemat

from identify.recording import InputError
from identify.recording.foreign import ColumnMap, measure, read_foreign

FILES = Path(__file__).parent / "files"
TIME = np.arange(200) / 500
POSITION = np.sin(3 * TIME)
CURRENT = np.cos(2 * TIME)


def numbers(table, name):
    """A column's numbers."""
    return table.column(name, "a test").numbers


@pytest.mark.parametrize("version", ["4", "5"])
@pytest.mark.parametrize("compressed", [False, True])
def test_variables_written_by_scipy_are_columns(tmp_path, version, compressed):
    variables = {"t": TIME, "q": np.stack([POSITION, CURRENT], axis=1), "gain": 3.5, "counts": np.arange(200)}
    savemat(tmp_path / "log.mat", variables, format=version, do_compression=compressed and version == "5")
    table = read_foreign(tmp_path / "log.mat")
    np.testing.assert_array_equal(numbers(table, "t"), TIME)
    np.testing.assert_array_equal(numbers(table, "q:2"), CURRENT)
    np.testing.assert_array_equal(numbers(table, "counts"), np.arange(200))
    assert table.scalars == {"gain": 3.5}


def test_structs_and_cells_are_opened(tmp_path):
    inside = {
        "axis": {"position": POSITION, "name": "j1"},
        "single": np.array([[{"x": CURRENT}]], dtype=object),
    }
    savemat(tmp_path / "log.mat", {"log": inside, "t": TIME.astype(np.float32)})
    table = read_foreign(tmp_path / "log.mat")
    np.testing.assert_array_equal(numbers(table, "log.axis.position"), POSITION)
    np.testing.assert_array_equal(numbers(table, "t"), TIME.astype(np.float32))


@pytest.mark.parametrize("version", ["v7", "v7.3"])
def test_tables_and_time_series_are_opened(version):
    """Written by mat-io 1.0.2, which shares no line with our reader: a table, a timetable, a time series, a struct."""
    table = read_foreign(FILES / f"objects-{version}.mat")
    for name, wanted in (
        ("T.t", TIME),
        ("T.q", POSITION),
        ("T.i", CURRENT),
        ("TT.Time", TIME),
        ("TT.q", POSITION),
        ("ts.Time", TIME),
        ("ts.Data", POSITION),
        ("s.a.b", TIME),
    ):
        np.testing.assert_allclose(numbers(table, name), wanted, rtol=0, atol=1e-12, err_msg=name)
    found = measure(table, ColumnMap(("T.q",), ("T.i",), "ts.Time"), [False])
    np.testing.assert_array_equal(found.position[:, 0], POSITION)


@pytest.mark.parametrize("cut", [130, 200, 400, 700])
def test_a_file_that_is_cut_short_is_refused(tmp_path, cut):
    savemat(tmp_path / "log.mat", {"q": POSITION})
    whole = (tmp_path / "log.mat").read_bytes()
    (tmp_path / "log.mat").write_bytes(whole[:cut])
    with pytest.raises(InputError, match=r"cannot be read as a MAT file: |holds no column"):
        read_foreign(tmp_path / "log.mat")


def doubled(path, stand):
    """An HDF5 file of 24 steps, each of which holds the one before twice: 16 million values."""
    with h5py.File(path, "w") as file:
        last = file.create_dataset("#refs#/first", data=TIME)
        for step in range(24):
            name = f"#refs#/step{step}"
            if stand == "references":
                last = file.create_dataset(name, data=np.array([last.ref, last.ref], dtype=h5py.ref_dtype))
            else:
                group = file.create_group(name)
                group["a"] = group["b"] = last
                last = group
        file["top"] = last


@pytest.mark.parametrize("stand", ["references", "links"])
def test_what_unfolds_without_end_is_refused(tmp_path, stand):
    doubled(tmp_path / "laughs.mat", stand)
    with pytest.raises(InputError, match="its groups and cells hold each other again and again"):
        read_foreign(tmp_path / "laughs.mat")


def test_many_references_to_one_large_array_are_refused(tmp_path):
    with h5py.File(tmp_path / "log.mat", "w") as file:
        large = file.create_dataset("#refs#/large", data=np.arange(20_000.0))
        file.create_dataset("top", data=np.array([large.ref] * 1000, dtype=h5py.ref_dtype))
    with pytest.raises(InputError, match="again and again"):
        read_foreign(tmp_path / "log.mat")


def test_one_array_may_stand_in_several_groups(tmp_path):
    with h5py.File(tmp_path / "log.h5", "w") as file:
        file["run/t"] = TIME
        file["run/q"] = POSITION
        for name in ("run/axis1/t", "run/axis2/t"):
            file[name] = file["run/t"]
    table = read_foreign(tmp_path / "log.h5")
    np.testing.assert_array_equal(numbers(table, "run.axis2.t"), TIME)


@pytest.mark.parametrize("kind", ["mat", "v7.3"])
def test_elements_of_a_cell_array_are_columns_by_their_number(tmp_path, kind):
    arrays = (TIME, POSITION, CURRENT)
    if kind == "mat":
        cells = np.empty((1, 3), object)
        for place, each in enumerate(arrays):
            cells[0, place] = each
        savemat(tmp_path / "log.mat", {"log": cells})
    else:
        with h5py.File(tmp_path / "log.mat", "w") as file:
            parts = [file.create_dataset(f"#refs#/{k}", data=each[None]) for k, each in enumerate(arrays)]
            file.create_dataset("log", data=np.array([[each.ref for each in parts]], dtype=h5py.ref_dtype))
    table = read_foreign(tmp_path / "log.mat")
    for place, wanted in enumerate(arrays, start=1):
        np.testing.assert_array_equal(numbers(table, f"log.{place}"), wanted)


def test_records_of_an_hdf5_table_and_the_units_of_attributes_are_read(tmp_path):
    records = np.array(list(zip(TIME, POSITION, strict=True)), dtype=[("t", "f8"), ("q", "f8")])
    with h5py.File(tmp_path / "log.h5", "w") as file:
        file["log"] = records
        file["i"] = CURRENT
        file["i"].attrs["units"] = "mA"
        file["q"] = np.degrees(POSITION)
        file["q"].attrs["Unit"] = np.bytes_(b"deg")
    table = read_foreign(tmp_path / "log.h5")
    np.testing.assert_array_equal(numbers(table, "log.q"), POSITION)
    session = measure(table, ColumnMap(("q",), ("i",), "log.t"), [False])
    np.testing.assert_allclose(session.position[:, 0], POSITION, atol=1e-12)
    np.testing.assert_allclose(session.command[:, 0], CURRENT * 1e-3, atol=1e-12)
