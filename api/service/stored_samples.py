"""The samples of one joint in one session, as a fit stores them."""

from dataclasses import dataclass, fields

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]


@dataclass(frozen=True)
class StoredSamples:
    """Filtered, decimated samples, (M,) each; mapped from a file, and read only as far as they are used.

    The order of the fields is that of the rows in the file.
    """

    time: Array
    """s, of the session"""
    position: Array
    """rad or m"""
    velocity: Array
    """rad/s or m/s"""
    acceleration: Array
    """rad/s² or m/s²"""
    load: Array
    """N m or N, tau_out of eq. (6)"""
    measured: Array
    """N m or N"""
    predicted: Array
    """N m or N"""
    moving: Array
    """1 where the sample takes part in the fit, else 0"""
    temperature: Array
    """°C, NaN where none was recorded"""

    @property
    def count(self) -> int:
        """M"""
        return len(self.time)

    def moves(self, rows: slice = slice(None)) -> NDArray[np.bool_]:
        """Which of some rows take part in the fit."""
        return np.asarray(self.moving[rows]) > 0

    def error(self, rows: slice = slice(None)) -> Array:
        """Measured less predicted in some rows; NaN where the joint rests: dry friction then takes any value, and such samples
        are no part of a fit."""
        error = np.asarray(self.measured[rows] - self.predicted[rows], dtype=np.float64)
        error[np.asarray(self.moving[rows]) == 0] = np.nan
        return error


COLUMNS = tuple(field.name for field in fields(StoredSamples))
