"""Free runs as they are kept: extremes of the errors stay, long rests after a run's end do not, damaged files are named."""

import numpy as np
import pytest

from api.service.free_run_curves import AFTERWARDS, POINTS, read_runs, stored_runs
from identify.recording import InputError
from identify.simulation.free_motion import FreeMotion


def motion(file, rows, ends=None, usual=True):
    """Two joints; the model's second one is 0.25 off in one sample, and its run ends early where `ends` says so."""
    time = 0.002 * np.arange(rows)
    q = np.column_stack([np.sin(time), np.cos(3.0 * time)])
    model = q.copy()
    model[rows // 3, 1] += 0.25
    model[rows if ends is None else ends :] = np.nan
    beside = q + 0.5 if usual else None
    return FreeMotion(file, time, q, 2.0 * q, model, 2.0 * q, beside, beside)


def test_a_long_session_is_reduced_and_its_extremes_stay(tmp_path):
    file = tmp_path / "runs.npz"
    file.write_bytes(stored_runs([motion("a.csv", 30_000), motion("b.csv", 300, usual=False)]))
    curves = read_runs(file, "a.csv", 1)
    assert len(curves.time) <= POINTS
    assert np.nanmax(curves.position.error) == pytest.approx(0.25, abs=1e-6)
    np.testing.assert_allclose(curves.position.error_usual, 0.5, atol=1e-6)
    assert np.nanmax(np.abs(curves.speed.error)) < 1e-6
    short = read_runs(file, "b.csv", 0)
    assert len(short.time) == 300
    assert np.isnan(short.position.usual).all()
    assert read_runs(file, "c.csv", 0) is None


def test_what_was_measured_after_both_runs_had_ended_is_left_out_but_for_a_little(tmp_path):
    file = tmp_path / "runs.npz"
    file.write_bytes(stored_runs([motion("a.csv", 30_000, ends=1000, usual=False)]))
    curves = read_runs(file, "a.csv", 0)
    assert curves.time[-1] == pytest.approx(0.002 * 1000 * (1.0 + AFTERWARDS), abs=0.01)
    assert np.isnan(curves.position.error[-1])


def test_stretches_of_a_record_with_holes_are_not_joined_by_a_line(tmp_path):
    file = tmp_path / "runs.npz"
    later = motion("a.csv", 200)
    file.write_bytes(
        stored_runs([motion("a.csv", 100), FreeMotion(**{**vars(later), "time": later.time + 9.0})])
    )
    curves = read_runs(file, "a.csv", 0)
    np.testing.assert_array_equal(np.flatnonzero(np.isnan(curves.time)), [100])
    assert curves.time[101] == pytest.approx(9.0, abs=1e-4)


def test_a_damaged_file_is_named_and_none_is_no_fault(tmp_path):
    file = tmp_path / "runs.npz"
    assert read_runs(file, "a.csv", 0) is None
    file.write_bytes(stored_runs([motion("a.csv", 100)])[:-40])
    with pytest.raises(InputError, match=r"runs\.npz: cannot be read .* predict the motion again"):
        read_runs(file, "a.csv", 0)
