"""Whether an axis follows worse with feedforward torque than it did without it, cycle by cycle of the same plan.

A model with the wrong sign, of another payload, right in one quadrant and wrong in the other: whatever is wrong with it, the axis
follows worse than it did at the same place of the plan without it. Torque of the wrong sign doubles the error, so that is tested
against an error as it was, in sequence (the cumulative sum of likelihood ratios of E. S. Page, Biometrika 41, 1954):

    excess <- max(0, excess + (error² - CLEARLY error_without² - resolution²) dt)

and the motion ends where it reaches what the drive without torque collected, on the mean of the plan, in `TOLERATED`. An error of
one count of the encoder is none. Torque that is twice what is needed turns the error round and leaves it as large; that is tested
against no error at all, in the same way:

    turned <- max(0, turned + (error² - (error + error_without)² - resolution²) dt)

which grows only where the error is nearer to the turned one than to none, and may reach `TURNED`. While the torque is faded in or
out the error tells of the fading, and only the bound in one cycle holds; a loop of ours needs no fading.
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
was faded in, friction alone 0.04 s (held over the bus 0.001 and 0.30 s); one with the wrong sign 34 s if nobody stops it, one
that is wrong in one quadrant alone 19 and 56 s."""
TURNED = 2.0
"""s of the same for an error that is turned round: it is no larger than without torque, so that there is time. A right model
reaches 0.01 s on the simulated RX130L and TX40, friction alone 0.03 s; `usual` on the TX40's wrist, whose motors it does not
describe, 0.88 s"""


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
        self._without = np.where(faded[:, None], np.nan, ahead.without)
        self._least = resolution**2
        known = ~np.isnan(self._without)
        mean = np.nansum(self._without**2, axis=0) / np.maximum(known.sum(axis=0), 1)
        usual = mean + self._least
        n = len(rig.axes)
        self._arrives_at: NDArray[Any] = np.full(n, np.nan)
        self._first: int | None = None
        self._worse, self._turned = SequentialSum(usual * TOLERATED), SequentialSum(usual * TURNED)

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
        beyond = [*self._in_one_cycle(np.abs(error)), *self._added_up(error, place)]
        return sorted(beyond, key=lambda excess: excess.row)

    def _in_one_cycle(self, error: Array) -> list[Excess]:
        with np.errstate(invalid="ignore"):
            beyond = error > self._within
        if not beyond.any():
            return []
        row, axis = divmod(int(beyond.argmax()), beyond.shape[1])
        excess = excess_in_words(error[row, axis], self._within[axis], self._units[axis])
        return [Excess(row, axis, f"with feedforward torque the following error grows: {excess}")]

    def _added_up(self, error: Array, place: NDArray[np.int64]) -> list[Excess]:
        inside = (place >= 0) & (place < len(self._without))
        usual = np.full(error.shape, np.nan)
        usual[inside] = self._without[place[inside]]
        known = ~np.isnan(error) & ~np.isnan(usual)
        now, then = (np.where(known, each, 0.0) for each in (error, usual))
        excess = now**2 - CLEARLY * then**2 - known * self._least
        turned = now**2 - (now + then) ** 2 - known * self._least
        listed = np.stack([now**2, then**2, known])
        added_up: list[Excess] = []
        for sums, steps, sentence in (
            (self._worse, excess, self._words_of_worse),
            (self._turned, turned, self._words_of_turned),
        ):
            first = sums.add(np.stack([steps, *listed]) * self._cycle)
            if first is not None:
                row, axis, (_, with_, without, seconds) = first
                error_now, usual_now = (1e3 * math.sqrt(each / seconds) for each in (with_, without))
                added_up.append(Excess(row, axis, sentence(self._units[axis], error_now, usual_now, seconds)))
        return added_up

    @staticmethod
    def _words_of_worse(unit: str, error: float, usual: float, seconds: float) -> str:
        return (
            f"feedforward torque makes it follow worse: its following error was {error:.3g} m{unit} rms for the last"
            f" {seconds:.2g} s, without the torque {usual:.3g} m{unit} at the same place of the plan"
        )

    @staticmethod
    def _words_of_turned(unit: str, error: float, usual: float, seconds: float) -> str:
        return (
            f"feedforward torque is too large: it turned the following error round, to {error:.3g} m{unit} rms"
            f" for the last {seconds:.2g} s, without the torque {usual:.3g} m{unit} at the same place of the plan"
        )


class SequentialSum:
    """Steps added up for each axis, anew from wherever the sum falls below nought (Page's cumulative sum), block by block.

    tolerated : (n,) what the sum may reach
    """

    def __init__(self, tolerated: Array) -> None:
        self._tolerated = tolerated
        self._sums: Array | None = None

    def add(self, steps: Array) -> tuple[int, int, list[float]] | None:
        """Row, axis and the k sums where the first row of steps (k, M, n) passes what is tolerated; None where it does not.

        The other k - 1 rows of steps are added up over the same time as the first.
        """
        before = np.zeros((len(steps), len(self._tolerated))) if self._sums is None else self._sums
        total = before[:, None] + np.cumsum(steps, axis=1)
        # where the sum falls to a new low below nought all is added up anew from there
        harmless = total[0] <= np.minimum(np.minimum.accumulate(total[0], axis=0), 0.0)
        number = np.arange(len(harmless), dtype=np.int64)[:, None]
        rows = np.maximum.accumulate(np.where(harmless, number, -1), axis=0)
        left = np.take_along_axis(total, np.maximum(rows, 0)[None], axis=1)
        total -= left * (rows >= 0)
        self._sums = total[:, -1]
        beyond = total[0] > self._tolerated
        if not beyond.any():
            return None
        row, axis = divmod(int(beyond.argmax()), beyond.shape[1])
        return row, axis, total[:, row, axis].tolist()
