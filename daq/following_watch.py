"""Whether an axis follows worse with feedforward torque than it did without it, cycle by cycle of the same plan.

A model with the wrong sign, of another payload, right in one quadrant and wrong in the other: whatever is wrong with it, the axis
follows worse than it did at the same place of the plan without it. Torque of the wrong sign doubles the error, so that is tested
against an error as it was, in sequence (the cumulative sum of likelihood ratios of E. S. Page, Biometrika 41, 1954):

    excess <- max(0, excess + (error² - CLEARLY error_without² - resolution²) dt)

and the motion ends where it reaches what the drive without torque collected, on the mean of the plan, in `TOLERATED`. An error of
one count of the encoder is none. While the torque is faded in or out the error tells of the fading, and only the bound in one
cycle holds; a loop of ours needs no fading.
"""

import math
from typing import Any

import numpy as np
from numpy.typing import NDArray

from daq.derivative_limits import Excess, excess_in_words
from daq.rig import Rig
from daq.samples import Phase
from daq.torque_offset import SentAhead, fading

Array = NDArray[np.float64]

CLEARLY = 4.0 / 3.0 * math.log(4.0)
"""of the squared error: where a normal error of twice the deviation becomes as likely as one of the same. Errors that are 36 %
larger are on neither side; those below are no reason to stop, and the result says that the torque did not help"""
TOLERATED = 1.0
"""s of the mean squared error of the drive without torque. On the simulated RX130L a right model reaches 0.07 s, just after it
was faded in, friction alone 0.04 s (held over the bus 0.001 and 0.30 s), one that is twice too large, which turns the error round
and leaves it as large, 0.27 s; one with the wrong sign 34 s if nobody stops it, one that is wrong in one quadrant alone 19 and
56 s."""


class FollowingWatch:
    """Judges the following errors of a plan against those of the drive without torque.

    Keeps, from one block of rows to the next, what was added up since the torque last did no harm: the excess, the squared errors
    with and without torque (rad² s or m² s), and for how long (s).
    """

    def __init__(self, rig: Rig, ahead: SentAhead) -> None:
        self._within = ahead.follows_within
        self._cycle = rig.cycle
        self._units = ["m" if joint.type == "prismatic" else "rad" for joint in rig.robot.joints]
        self._matrix, self._offset = rig.position_matrix, rig.position_offset
        resolution = np.abs(rig.position_matrix).sum(axis=1)
        faded = (fading(len(ahead.without), rig.cycle) < 1.0) & (ahead.loop is None)
        self._without = np.where(faded[:, None], np.nan, ahead.without**2)
        self._least = resolution**2
        known = ~np.isnan(self._without)
        mean = np.nansum(self._without, axis=0) / np.maximum(known.sum(axis=0), 1)
        self._tolerated = (mean + self._least) * TOLERATED
        n = len(rig.axes)
        self._arrives_at: NDArray[Any] = np.full(n, np.nan)
        self._first: int | None = None
        self._sums = np.zeros((4, n))

    def check(self, rows: NDArray[Any], position: Array) -> list[Excess]:
        """What ends the motion in these rows (M,) of `sample_dtype`; every row is to be fed in order.

        position : (M, n) rad or m; NaN where it did not come
        """
        planned = rows["phase"] == Phase.PLAN
        wanted = rows["setpoint"] @ self._matrix.T + self._offset
        wanted[~planned] = np.nan
        arrived = np.vstack([self._arrives_at, wanted[:-1]])
        self._arrives_at = wanted[-1]
        if self._first is None and planned.any():
            self._first = int(rows["cycle"][planned.argmax()])
        if self._first is None:
            return []
        error = np.where(planned[:, None], arrived - position, np.nan)
        # a setpoint that took effect in one cycle is reached in the next
        place = rows["cycle"] - self._first - 1
        return [*self._in_one_cycle(np.abs(error)), *self._added_up(error**2, place)]

    def _in_one_cycle(self, error: Array) -> list[Excess]:
        with np.errstate(invalid="ignore"):
            beyond = error > self._within
        if not beyond.any():
            return []
        row, axis = divmod(int(beyond.argmax()), beyond.shape[1])
        excess = excess_in_words(error[row, axis], self._within[axis], self._units[axis])
        return [Excess(row, axis, f"with feedforward torque the following error grows: {excess}")]

    def _added_up(self, squared: Array, place: NDArray[np.int64]) -> list[Excess]:
        inside = (place >= 0) & (place < len(self._without))
        usual = np.full(squared.shape, np.nan)
        usual[inside] = self._without[place[inside]]
        known = ~np.isnan(squared) & ~np.isnan(usual)
        with_, without = (np.where(known, each, 0.0) for each in (squared, usual))
        steps = (
            np.stack([with_ - CLEARLY * without - known * self._least, with_, without, known]) * self._cycle
        )
        total = self._sums[:, None] + np.cumsum(steps, axis=1)
        # where the sum falls to a new low below nought, the torque has done no harm: all is added up anew from there
        harmless = total[0] <= np.minimum(np.minimum.accumulate(total[0], axis=0), 0.0)
        rows = np.maximum.accumulate(np.where(harmless, np.arange(len(squared))[:, None], -1), axis=0)
        before = np.take_along_axis(total, np.maximum(rows, 0)[None], axis=1)
        total -= np.where(rows >= 0, before, 0.0)
        self._sums = total[:, -1]
        beyond = total[0] > self._tolerated
        if not beyond.any():
            return []
        row, axis = divmod(int(beyond.argmax()), beyond.shape[1])
        return [Excess(row, axis, self._words(axis, *total[1:, row, axis].tolist()))]

    def _words(self, axis: int, with_: float, without: float, seconds: float) -> str:
        unit = self._units[axis]
        error, usual = (1e3 * math.sqrt(sums / seconds) for sums in (with_, without))
        return (
            f"feedforward torque makes it follow worse: its following error was {error:.3g} m{unit} rms for the last"
            f" {seconds:.2g} s, without the torque {usual:.3g} m{unit} at the same place of the plan"
        )
