"""Joint torque of a recording's current references, of a file written here."""

import h5py
import numpy as np
import pytest

from daq.commanded_torque import commanded_torque
from daq.samples import COMMAND_CAME, POSITION_CAME

GAIN = np.array([[10.0, 0.0], [-2.0, 5.0]])


@pytest.fixture
def recording(tmp_path):
    """Cycles 100 to 107, 103 lost; the setpoints of 106 and 107 are no longer the plan's."""
    cycles = np.array([100, 101, 102, 104, 105, 106, 107])
    setpoint = np.column_stack([cycles, 10 * cycles])
    setpoint[-2:] += 1
    valid = np.full((7, 2), POSITION_CAME | COMMAND_CAME, np.uint8)
    valid[1, 1] = POSITION_CAME
    with h5py.File(tmp_path / "session-00.h5", "w") as file:
        for name, values in (("cycle", cycles), ("setpoint", setpoint), ("valid", valid)):
            file.create_dataset(name, data=values)
        command = file.create_dataset("command", data=np.column_stack([np.arange(7), np.arange(7) ** 2]))
        command.attrs["scale"] = [0.1, 0.01]
    return tmp_path / "session-00.h5"


def test_the_command_at_a_sync_belongs_to_the_setpoint_of_the_one_before(recording):
    """Rows whose predecessor is lost, or that one command of is, are left out."""
    plan = np.column_stack([100 + np.arange(8), 1000 + 10 * np.arange(8)]).astype(np.int32)
    found = commanded_torque(recording, plan, GAIN)
    assert found.cycle.tolist() == [1, 4, 5]
    rows = np.array([2, 4, 5])
    current = np.column_stack([0.1 * rows, 0.01 * rows**2])
    assert found.torque == pytest.approx(
        np.column_stack([10.0 * current[:, 0], 5.0 * current[:, 1] - 2.0 * current[:, 0]])
    )
