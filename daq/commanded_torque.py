"""What the drives asked of their motors while a plan was driven, as joint torque, cycle by cycle of the plan."""

from dataclasses import dataclass
from pathlib import Path

import h5py
import numpy as np
from numpy.typing import NDArray

from daq.following_error import rows_of_plan
from identify.recording.session_hdf5 import COMMAND, COMMAND_CAME, SCALE, VALID


@dataclass(frozen=True)
class CommandedTorque:
    """Of the cycles in which the command of every axis came.

    cycle  : (M,) cycle of the plan, from 0
    torque : (M, n) N m or N, the current references times the drive gains, eq. (4)
    """

    cycle: NDArray[np.int64]
    torque: NDArray[np.float64]


def commanded_torque(
    recording: Path, counts: NDArray[np.int32], drive_gain: NDArray[np.float64]
) -> CommandedTorque:
    """Of a recording (HDF5), while its setpoints were the plan's: (L, n) `counts`, a row for each cycle.

    drive_gain : (n, n) N m/A, eq. (4)
    The command at a SYNC belongs to the setpoint of the one before, as the following error does.
    """
    with h5py.File(recording, "r") as file:
        rows, place = rows_of_plan(file, counts)
        command = file[COMMAND]
        assert isinstance(command, h5py.Dataset)
        current = np.asarray(command, float) * np.asarray(command.attrs[SCALE])
        valid = np.asarray(file[VALID])
    came = (valid[rows] & COMMAND_CAME > 0).all(axis=1)
    return CommandedTorque(place[came], current[rows[came]] @ drive_gain.T)
