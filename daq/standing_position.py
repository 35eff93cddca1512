"""A position that stands, to the count, while its setpoint goes on or its drive gives all its current: an encoder or its cable, a
drive that says the same again and again, a closed brake, something in the way.

A drive that is told its axis stands gives it all its current, and so does a loop over the bus; the axis may be under way already.
An axis that friction holds still moves its encoder by some counts, for gears and bearings give way; one that stands to the very
count for so long does not, or is not seen to. So it is stopped at a part of the following error that is allowed otherwise, or
as soon as it had all its current for a moment: before the approach already, where an axis that nobody holds falls.
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
ALL_CURRENT = 0.9
"""of the current limit: as good as all that the axis is allowed"""
MOMENT = 0.05
"""s of all its current, within which whatever is free to turn has turned by a count"""


class StandingPosition:
    """Keeps where each drive's setpoint was when its position last changed."""

    def __init__(self, rig: Rig) -> None:
        n = len(rig.axes)
        following = np.array([axis.limits.following_error for axis in rig.axes])
        way = np.abs(rig.position_matrix)  # of each joint for a count of each drive
        counts = np.divide(following[:, None], way, out=np.full_like(way, np.inf), where=way > 0)
        self._most = np.maximum(SHARE * counts.min(axis=0), FEWEST)
        self._all_current = ALL_CURRENT * np.array([axis.limits.current for axis in rig.axes])
        self._moment = max(2, round(MOMENT / rig.cycle))
        self._before: NDArray[np.int64] | None = None
        self._setpoint = np.zeros(n, np.int64)
        self._strained_for = np.zeros(n, np.int64)

    def check(
        self,
        rows: NDArray[Any],
        came: NDArray[np.bool_],
        following: NDArray[np.bool_],
        held: NDArray[np.bool_],
        current: NDArray[np.float64],
    ) -> Excess | None:
        """The first row of these (M,) of `sample_dtype` in which a position has stood for too long.

        came      : (M, n) whether a position came
        following : (M,) rows in which the drives follow setpoints
        held      : (M,) rows in which they hold their axes
        current   : (M, n) A, magnitude of the current reference; 0 where none came
        """
        position = rows["position"].astype(np.int64)
        before = np.vstack([position[:1] if self._before is None else self._before[None], position[:-1]])
        # where nothing came nothing stands: that is silence, which is judged by itself
        moved = (position != before) | ~came
        if self._before is None:
            moved[0] = True
        self._before = position[-1]
        excesses = (
            self._gone_on(rows, moved | ~following[:, None]),
            self._strained(position, moved | ~(following | held)[:, None], current),
        )
        return min((each for each in excesses if each is not None), key=lambda each: each.row, default=None)

    def _gone_on(self, rows: NDArray[Any], moved: NDArray[np.bool_]) -> Excess | None:
        """Where a setpoint went on for too long."""
        position, setpoint = rows["position"], rows["setpoint"].astype(np.int64)
        last = np.maximum.accumulate(np.where(moved, np.arange(len(rows))[:, None], -1), axis=0)
        at_change = np.where(
            last >= 0, np.take_along_axis(setpoint, np.maximum(last, 0), axis=0), self._setpoint
        )
        self._setpoint = at_change[-1]
        gone_on = np.abs(setpoint - at_change)
        beyond = gone_on > self._most
        if not beyond.any():
            return None
        row, axis = divmod(int(beyond.argmax()), beyond.shape[1])
        return _standing(row, axis, position[row, axis], f"its setpoint went on by {gone_on[row, axis]}")

    def _strained(
        self,
        position: NDArray[np.int64],
        moved: NDArray[np.bool_],
        current: NDArray[np.float64],
    ) -> Excess | None:
        """Where an axis had all its current for too long."""
        index = np.arange(1, len(position) + 1)[:, None]
        eased = moved | (current < self._all_current)
        strained_for = index - np.maximum.accumulate(np.where(eased, index, -self._strained_for), axis=0)
        self._strained_for = strained_for[-1]
        beyond = strained_for >= self._moment
        if not beyond.any():
            return None
        row, axis = divmod(int(beyond.argmax()), beyond.shape[1])
        return _standing(
            row, axis, position[row, axis], f"its drive gave {current[row, axis]:.3g} A, all that it may"
        )


def _standing(row: int, axis: int, position: int, meanwhile: str) -> Excess:
    return Excess(
        row,
        axis,
        f"its position stands at {position} counts while {meanwhile}: it may move all the same, keep clear; look at the encoder"
        " and its cable, at the brake, and for something in the way",
        unseen=True,
    )
