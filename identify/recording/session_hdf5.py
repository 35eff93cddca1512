"""The layout of a recorded session in HDF5, and its reader."""

from __future__ import annotations

from pathlib import Path

from identify.recording.session_csv import RawSamples

FORMAT = 1
CYCLE, SYNC_TIME, POSITION, COMMAND = "cycle", "sync_time", "position", "command"
SETPOINT, VALID, TEMPERATURE = "setpoint", "valid", "temperature"
POSITION_CAME, COMMAND_CAME, CAME_LATE = 1, 2, 4
"""Bits of `valid`."""


def read_hdf5_session(path: Path, n: int) -> RawSamples:
    """Read a recorded session of n joints."""
    import h5py
    import numpy as np

    with h5py.File(path, "r", swmr=True) as file:
        position, command = file[POSITION], file[COMMAND]
        q = position[:] @ np.asarray(position.attrs["matrix"]).T + position.attrs["offset"]
        v = command[:] * np.asarray(command.attrs["scale"])
        time = file[SYNC_TIME][:] * 1e-9
        return RawSamples(time - time[0], q, v)
