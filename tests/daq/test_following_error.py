"""How far an axis was behind, of a recording written here whose errors are known."""

from __future__ import annotations

from pathlib import Path

import h5py
import numpy as np
import pytest

from daq.following_error import following_error

MATRIX = np.array([[1e-3, 0.0], [2e-3, -5e-3]])
"""rad per count; the second joint is coupled to the first encoder"""


def recording(folder: Path, cycle, setpoint, position, came=None) -> Path:
    path = folder / "session-00.h5"
    with h5py.File(path, "w") as file:
        file["cycle"] = np.asarray(cycle, np.int64)
        file["setpoint"] = np.asarray(setpoint, np.int32)
        file["position"] = np.asarray(position, np.int32)
        file["position"].attrs["matrix"] = MATRIX
        file["valid"] = np.full(np.shape(position), 3, np.uint8) if came is None else came
    return path


def plan(rows: int) -> np.ndarray:
    return np.column_stack([10 * np.arange(rows), -3 * np.arange(rows)]).astype(np.int32)


def test_a_position_is_held_against_the_setpoint_of_the_sync_before(tmp_path):
    counts, behind = plan(6), np.array([[4, 0], [-2, 7], [0, 0], [1, -1], [6, 2]])
    position = np.zeros((6, 2), int)
    position[1:] = counts[:-1] - behind
    found = following_error(recording(tmp_path, np.arange(20, 26), counts, position), counts)
    assert found.cycle.tolist() == [0, 1, 2, 3, 4]
    by_hand = np.column_stack([1e-3 * behind[:, 0], 2e-3 * behind[:, 0] - 5e-3 * behind[:, 1]])
    np.testing.assert_allclose(found.error, by_hand, atol=1e-15)
    np.testing.assert_allclose(found.rms(), np.sqrt(np.mean(by_hand**2, axis=0)))
    np.testing.assert_allclose(found.peak(), np.abs(by_hand).max(axis=0))


def test_across_a_missing_cycle_and_beyond_the_plan_nothing_is_compared(tmp_path):
    counts = plan(8)
    cycle = np.array([0, 1, 2, 4, 5, 6, 7, 8, 9])
    setpoint = plan(10)[cycle]  # the last row is not of the plan
    setpoint[5] = 999  # a stop: no longer the plan's setpoint
    found = following_error(recording(tmp_path, cycle, setpoint, setpoint), counts)
    assert found.cycle.tolist() == [0, 1, 4, 5, 7]


def test_a_position_that_did_not_come_is_not_a_number_and_counts_for_nothing(tmp_path):
    counts = plan(5)
    came = np.full((5, 2), 3, np.uint8)
    came[2, 1] = 2  # the command came, the position did not
    position = counts - 10  # as the setpoint before, less nothing: 10 counts on the first encoder each cycle
    found = following_error(recording(tmp_path, np.arange(5), counts, position, came), counts)
    assert np.isnan(found.error).sum(axis=0).tolist() == [0, 1]
    assert np.isfinite(found.rms()).all()
    assert found.peak()[0] == pytest.approx(0.0)
