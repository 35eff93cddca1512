"""What is asked of a session again and again, so that its samples need not be at hand for it."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

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
    commanded: NDArray[np.bool_]
    """(n,) whether the recorded command is ever other than zero"""
    has_external: bool
    remarks: tuple[str, ...]


def ever_commanded(command: Array) -> NDArray[np.bool_]:
    """(n,) whether a column is ever other than zero; looks no further than needed."""
    commanded = np.zeros(command.shape[1], bool)
    for first in range(0, len(command), SAMPLES):
        commanded |= np.any(command[first : first + SAMPLES], axis=0)
        if commanded.all():
            break
    return commanded
