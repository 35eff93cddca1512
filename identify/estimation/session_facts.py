"""What is asked of a session again and again, so that its samples need not be at hand for it."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from identify.estimation.command_limits import Standing
from identify.signals.position_noise import SAMPLES

Array = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class SessionFacts:
    """Figures of one session."""

    start: float
    """s, time of the first sample"""
    duration: float
    """s"""
    period: float
    """s, of sampling"""
    position_step: Array
    """(n,) smallest step between recorded positions, rad or m; infinite where none was seen"""
    position_rounding: Array
    """(n,) step that would give the scatter of the recorded positions from sample to sample, rad or m"""
    steady_command: Array
    """(n,) the recorded command where every sample of it is the same; nan where it changes"""
    standing: tuple[tuple[Standing, ...], ...]
    """of every motor where its command stands while it moves, part by part"""
    has_external: bool
    remarks: tuple[str, ...]


def steady_command(command: Array) -> Array:
    """(n,) the value of columns of which every sample is the same, nan of others; looks no further than needed."""
    changes = np.zeros(command.shape[1], bool)
    for first in range(0, len(command), SAMPLES):
        changes |= np.any(command[first : first + SAMPLES] != command[0], axis=0)
        if changes.all():
            break
    return np.where(changes, np.nan, command[0])
