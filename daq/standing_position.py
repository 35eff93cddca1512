"""A position that stands, to the count, while its setpoint goes on: an encoder or its cable, a drive that says the same again and
again, a closed brake, something in the way.

A drive that is told its axis stands gives it all its current, and so does a loop over the bus; the axis may be under way already.
An axis that friction holds still moves its encoder by some counts, for gears and bearings give way; one that stands to the very
count for so long does not, or is not seen to. So it is stopped at a part of the following error that is allowed otherwise.
"""

from typing import Any

import numpy as np
from numpy.typing import NDArray

from daq.derivative_limits import Excess
from daq.rig import Rig

SHARE = 0.25
"""of the limit of the following error, which a setpoint may go on while the position stands"""
FEWEST = 20
"""counts that it may go on in any case: an encoder as coarse as that stands for a while by itself"""


class StandingPosition:
    """Keeps where each drive's setpoint was when its position last changed."""

    def __init__(self, rig: Rig) -> None:
        n = len(rig.axes)
        following = np.array([axis.limits.following_error for axis in rig.axes])
        way = np.abs(rig.position_matrix)  # of each joint for a count of each drive
        counts = np.divide(following[:, None], way, out=np.full_like(way, np.inf), where=way > 0)
        self._most = np.maximum(SHARE * counts.min(axis=0), FEWEST)
        self._before: NDArray[np.int64] | None = None
        self._setpoint = np.zeros(n, np.int64)

    def check(
        self, rows: NDArray[Any], came: NDArray[np.bool_], following: NDArray[np.bool_]
    ) -> Excess | None:
        """The first row of these (M,) of `sample_dtype` in which a setpoint has gone on for too long.

        came      : (M, n) whether a position came
        following : (M,) rows in which the drives follow setpoints
        """
        position, setpoint = rows["position"].astype(np.int64), rows["setpoint"].astype(np.int64)
        before = np.vstack([position[:1] if self._before is None else self._before[None], position[:-1]])
        # where nothing came nothing stands: that is silence, which is judged by itself
        moved = (position != before) | ~came | ~following[:, None]
        if self._before is None:
            moved[0] = True
        last = np.maximum.accumulate(np.where(moved, np.arange(len(rows))[:, None], -1), axis=0)
        at_change = np.where(
            last >= 0, np.take_along_axis(setpoint, np.maximum(last, 0), axis=0), self._setpoint
        )
        self._before, self._setpoint = position[-1], at_change[-1]
        gone_on = np.abs(setpoint - at_change)
        beyond = gone_on > self._most
        if not beyond.any():
            return None
        row, axis = divmod(int(beyond.argmax()), beyond.shape[1])
        return Excess(
            row,
            axis,
            f"its position stands at {position[row, axis]} counts while its setpoint went on by {gone_on[row, axis]}: it may move"
            " all the same, keep clear; look at the encoder and its cable, at the brake, and for something in the way",
        )
