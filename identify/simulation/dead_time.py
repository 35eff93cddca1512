"""The time between a command and its torque in a closed loop: what was commanded is kept until it acts."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from identify.simulation.measured_motion import MeasuredMotion
from identify.simulation.torque_model import TorqueModel

Array = NDArray[np.float64]
Rows = NDArray[np.intp]

SHORTEST_PART = 2.5e-4
"""s: parts of a sample are not made shorter for a dead time; one below half of that is what holding the command makes"""


def dead_times(model: TorqueModel) -> Array:
    """(n,) s from a joint's command to its torque.

    A command that is recorded later than it acts says how the record was made and nothing of the loop: 0 there.
    """
    seconds = np.zeros(model.joints)
    for joint, lead in model.command_lead:
        seconds[joint] += max(0.0, -lead)
    return seconds


def parts_for(seconds: Array, period: float) -> int:
    """Parts of a sample of `period` s that are no longer than twice the shortest dead time."""
    if not np.any(seconds):
        return 1
    shortest = max(2.0 * float(seconds[seconds > 0.0].min()), SHORTEST_PART)
    return max(1, math.ceil(period / shortest - 1e-9))


class DeadTime:
    """Commanded torques of windows, each held over a part of a sample, until they act.

    model   : says of each joint how late its torque acts
    first   : (windows,) rows of the measured motion where the windows begin; before them the recorded torque was commanded
    period  : s, of a part
    held    : parts by which holding a command over a part delays it already, on average: 0.5 where it is that of the part's
        beginning, 0 where it is that of its middle
    """

    def __init__(
        self, model: TorqueModel, motion: MeasuredMotion, first: Rows, period: float, held: float
    ) -> None:
        late = np.maximum(0.0, dead_times(model) / period - held)
        self._whole = np.floor(late).astype(int)
        self._share = late - self._whole
        depth = int(self._whole.max(initial=0)) + 1
        self._sent = [_recorded(motion, motion.time[first] - (k + 0.5 + held) * period) for k in range(depth)]

    def acting(self, commanded: Array) -> Array:
        """(windows, joints) N m or N: mean of what acts over the part at which a torque is commanded."""
        self._sent = [commanded, *self._sent]
        torque = np.empty(commanded.shape)
        for joint, (whole, share) in enumerate(zip(self._whole, self._share, strict=True)):
            later, sooner = self._sent[whole + 1][:, joint], self._sent[whole][:, joint]
            torque[:, joint] = (1.0 - share) * sooner + share * later
        self._sent.pop()
        return torque


def _recorded(motion: MeasuredMotion, time: Array) -> Array:
    """(windows, joints): the recorded torque at some times, at its first row before."""
    return np.column_stack([np.interp(time, motion.time, torque) for torque in motion.torque.T])
