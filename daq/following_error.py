"""How far behind its setpoints a recorded axis was, cycle by cycle of the plan."""

from dataclasses import dataclass
from pathlib import Path

import h5py
import numpy as np
from numpy.typing import NDArray

from daq.samples import joint_positions
from identify.recording.session_hdf5 import CYCLE, MATRIX, POSITION, SETPOINT, VALID


@dataclass(frozen=True)
class FollowingError:
    """Setpoint less position while a plan was driven; NaN where a position did not come.

    cycle : (M,) cycle of the plan, from 0
    error : (M, n) rad or m
    """

    cycle: NDArray[np.int64]
    error: NDArray[np.float64]

    def rms(self) -> NDArray[np.float64]:
        """(n,) rad or m."""
        return np.sqrt(np.nanmean(self.error**2, axis=0))

    def peak(self) -> NDArray[np.float64]:
        """(n,) rad or m, magnitude."""
        return np.nanmax(np.abs(self.error), axis=0)

    def over(self, cycles: int) -> NDArray[np.float64]:
        """(cycles, n) rad or m, a row for each cycle of the plan; NaN where there is no error."""
        every = np.full((cycles, self.error.shape[1]), np.nan)
        every[self.cycle] = self.error
        return every


def following_error(recording: Path, counts: NDArray[np.int32]) -> FollowingError:
    """Of a recording (HDF5), while its setpoints were the plan's: (L, n) `counts`, a row for each cycle.

    A setpoint takes effect at one SYNC and is reached at the next, so the position at a SYNC is held against the setpoint of
    the one before.
    """
    with h5py.File(recording, "r") as file:
        rows, place = rows_of_plan(file, counts)
        position = file[POSITION]
        assert isinstance(position, h5py.Dataset)
        matrix = np.asarray(position.attrs[MATRIX])
        encoder, setpoint = np.asarray(position, float), np.asarray(file[SETPOINT], float)
        valid = np.asarray(file[VALID])
    # both are counts of one encoder, whose zero drops out
    error = joint_positions(setpoint[rows - 1] - encoder[rows], valid[rows], matrix, 0.0)
    return FollowingError(place, error)


def rows_of_plan(file: h5py.File, counts: NDArray[np.int32]) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    """Rows of a recording at whose SYNC a setpoint of the plan was to be reached, and the plan's cycle (from 0) of each.

    counts : (L, n) setpoints of the plan, a row for each cycle
    """
    cycle, setpoint = np.asarray(file[CYCLE], np.int64), np.asarray(file[SETPOINT], float)
    follows = np.flatnonzero(np.diff(cycle) == 1)
    place = cycle[follows] - cycle[:1]
    kept = np.zeros(len(place), bool)
    inside = place < len(counts)
    kept[inside] = (setpoint[follows[inside]] == counts[place[inside]]).all(axis=1)
    return follows[kept] + 1, place[kept]
