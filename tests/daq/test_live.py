"""The live view on a ring: the newest samples, in SI units, and nothing where nothing came."""

from __future__ import annotations

import numpy as np
import pytest

from daq.live import LiveRows, LiveView
from daq.rig import Rig
from daq.ring_buffer import RingWriter
from daq.samples import COMMAND_CAME, POSITION_CAME, Phase, sample_dtype


@pytest.fixture(scope="module")
def six_axes() -> Rig:
    return Rig.load("tx40-simulated")


def written(rig: Rig, count: int) -> np.ndarray:
    """Rows of a ring: everything came, each value tells its row and axis."""
    n = len(rig.axes)
    rows = np.zeros(count, sample_dtype(n))
    rows["cycle"] = np.arange(7, 7 + count)
    rows["sync_time"] = np.arange(count) * 4_000_000 + 1_500_000_000
    rows["position"] = 1000 * np.arange(count)[:, None] + np.arange(n)
    rows["setpoint"] = rows["position"] + 5
    rows["command"] = 10 * np.arange(n) - 20
    rows["valid"] = POSITION_CAME | COMMAND_CAME
    rows["temperature"] = 30.5
    rows["phase"] = Phase.PLAN
    return rows


def test_the_newest_samples_come_in_si_units(six_axes):
    rows = written(six_axes, 50)
    with RingWriter(rows.dtype, 64) as writer:
        writer.write(rows)
        view = LiveView.attach(six_axes, writer.name)
        assert view is not None
        newest = view.latest(10 * six_axes.cycle)
        view.close()
        writer.unlink()
    assert newest.cycle.tolist() == list(range(47, 57))
    np.testing.assert_allclose(newest.time, 1.5 + 0.004 * np.arange(40, 50))
    # each joint by hand: its own row of the matrix
    for joint in range(6):
        by_hand = sum(
            six_axes.position_matrix[joint, axis] * (1000.0 * np.arange(40, 50) + axis) for axis in range(6)
        )
        np.testing.assert_allclose(newest.position[:, joint], by_hand + six_axes.position_offset[joint])
        np.testing.assert_allclose(
            newest.setpoint[:, joint],
            by_hand + 5 * six_axes.position_matrix[joint].sum() + six_axes.position_offset[joint],
        )
    np.testing.assert_allclose(newest.command[3], (10 * np.arange(6) - 20) * six_axes.command_scale)
    assert set(newest.phase.tolist()) == {Phase.PLAN}
    assert newest.temperature.tolist() == [[30.5] * 6] * 10


def test_less_than_a_cycle_is_one_sample_and_more_than_there_is_all(six_axes):
    rows = written(six_axes, 5)
    with RingWriter(rows.dtype, 64) as writer:
        writer.write(rows)
        view = LiveView.attach(six_axes, writer.name)
        assert view is not None
        assert view.latest(0.0).cycle.tolist() == [11]
        assert len(view.latest(3600.0).time) == 5
        view.close()
        writer.unlink()


def test_what_did_not_come_is_not_a_number_on_the_joints_that_it_moves_and_on_no_other(six_axes):
    rows = written(six_axes, 2)
    silent, without_command = 4, 1
    rows["valid"][1, silent] = COMMAND_CAME
    rows["valid"][1, without_command] = POSITION_CAME
    shown = LiveRows.of(six_axes, rows)
    moved = np.flatnonzero(six_axes.position_matrix[:, silent])
    assert np.flatnonzero(np.isnan(shown.position[1])).tolist() == moved.tolist()
    assert len(moved) == 2, "axes 5 and 6 of this arm are coupled"
    assert np.flatnonzero(np.isnan(shown.command[1])).tolist() == [without_command]
    assert np.isfinite(shown.position[0]).all()
    assert np.isfinite(shown.command[0]).all()
    assert np.isfinite(shown.setpoint).all()


def test_no_ring_is_no_view_and_no_samples(six_axes):
    assert LiveView.attach(six_axes, "coulomb-test-of-no-ring-rows") is None
    nothing = LiveRows.empty(six_axes)
    assert nothing.position.shape == nothing.command.shape == (0, 6)
    assert nothing.time.shape == (0,)
