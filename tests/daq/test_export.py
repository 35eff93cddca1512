"""A recording exported in SI units holds the columns that an identification reads from the recording itself."""

from __future__ import annotations

import numpy as np
import pytest
import scipy.io
from pyarrow import parquet

from daq.export import export_session
from identify.recording.session_csv import read_csv_session
from identify.recording.session_hdf5 import read_hdf5_session
from tests.identify.recording.test_session_hdf5 import recording


@pytest.mark.parametrize("ending", ["csv", "CSV", "Csv.GZ", "mat", "MAT", "parquet"])
def test_the_reference_of_an_export_is_the_setpoint_in_force_as_in_the_recording(tmp_path, ending):
    sent = np.random.default_rng(1).integers(-1000, 1000, (300, 2)).astype(np.int32)
    valid = np.full((300, 2), 3, np.uint8)
    valid[[50, 51, 120], 0] = 0  # a CSV leaves these rows out, and the next row's setpoint is still its own
    recording(tmp_path / "s.h5", rows=300, setpoint=sent, valid=valid)
    read = read_hdf5_session(tmp_path / "s.h5", 2, setpoints=True).extra
    expected = np.column_stack([read["qref1"], read["qref2"]])
    target = tmp_path / f"s.{ending}"
    export_session(tmp_path / "s.h5", target)
    if ending.lower().startswith("csv"):
        assert (target.read_bytes()[:2] == b"\x1f\x8b") == ending.lower().endswith("gz")
        found = read_csv_session(target, 2).extra
        expected = expected[(valid == 3).all(axis=1)]
        assert np.column_stack([found["qref1"], found["qref2"]]) == pytest.approx(expected, abs=1e-12)
    elif ending.lower() == "mat":
        assert scipy.io.loadmat(target)["qref"] == pytest.approx(expected, abs=1e-12)
    else:
        table = parquet.read_table(target)
        found = np.column_stack([table["qref1"].to_numpy(), table["qref2"].to_numpy()])
        assert found == pytest.approx(expected, abs=1e-12)
