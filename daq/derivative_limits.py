"""Velocity and acceleration of the samples against their limits, so that no lateness of ours is taken for a motion.

Both are differences over a window, and differences magnify whatever is wrong with a sample. What is wrong is known,
and is allowed for:

- *rounding*: a count of the encoder at either end of a window;
- *one wrong sample*: a value must be beyond its limit in `LASTING` rows in a row;
- *the clock*: a stamp is as late as the process or the adapter that stamped it, while the count of SYNCs does not know
  of a SYNC that went out late. A motion that is too fast is so by both clocks; what is so by one alone is the clock;
- *answers in the wrong cycle*: a drive whose answers fall behind by a cycle seems to stand for a cycle, and one that
  catches up seems to jump. Where that happens an answer lacks or comes again, and the row says so (`valid`). A window
  in which answers fell behind or caught up by k cycles may hold k cycles' motion less or more than there was.
"""

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from daq.rig import Rig

Array = NDArray[np.float64]

LASTING = 3
"""rows"""


@dataclass(frozen=True)
class Excess:
    """What goes beyond a limit.

    unseen : whether it says that the position itself is not to be believed, so that nobody sees whether the axis stops
    """

    row: int
    axis: int
    words: str
    unseen: bool = False


def excess_in_words(value: float, limit: float, unit: str) -> str:
    """A value and the limit that it is beyond, with as many digits as it takes to tell them apart: 18.0003 A above 18 A."""
    digits = next((digits for digits in range(4, 17) if float(f"{value:.{digits}g}") > limit), 17)
    return f"{value:.{digits}g} {unit} above {limit:g} {unit}"


class DerivativeLimits:
    """Checks positions block by block; keeps what differences need from one block to the next."""

    def __init__(self, rig: Rig) -> None:
        supervision = rig.supervision
        limits = [axis.limits for axis in rig.axes]
        self._cycle = rig.cycle
        self._velocity_limit = np.array([limit.velocity for limit in limits])
        self._acceleration_limit = np.array([limit.acceleration for limit in limits])
        self._velocity_margin = supervision.velocity_margin
        self._held_share = supervision.approach_speed
        self._acceleration_margin = supervision.acceleration_margin
        self._units = ["m" if joint.type == "prismatic" else "rad" for joint in rig.robot.joints]
        self._resolution = np.abs(rig.position_matrix).sum(axis=1)
        self._window = max(1, round(supervision.window / rig.cycle))
        n = len(limits)
        self._kept = 2 * self._window + LASTING - 1
        self._clocks: Array = np.empty((0, 2))
        self._positions: Array = np.empty((0, n))
        self._misplaced: NDArray[np.int_] = np.empty((0, n), int)
        self._judged: NDArray[np.bool_] = np.empty(0, bool)
        self._held: NDArray[np.bool_] = np.empty(0, bool)
        self._needs = rig.position_matrix != 0
        self._behind = np.zeros(n, int)

    def check(
        self,
        clocks: Array,
        position: Array,
        lacking: NDArray[np.bool_],
        again: NDArray[np.bool_],
        judged: NDArray[np.bool_],
        held: NDArray[np.bool_],
    ) -> list[Excess]:
        """The first velocity and the first acceleration beyond the limits in these M rows.

        clocks   : (M, 2) s, the rows' time by two clocks
        position : (M, n) rad or m, NaN where none came
        lacking  : (M, n) whether a drive's position did not come in its cycle
        again    : (M, n) whether it came more than once
        judged   : (M,) rows at standstill count for the differences but are not judged
        held     : (M,) rows at standstill with power: a held axis must not turn, but a brake that opens may jerk it
        """
        misplaced = self._misplaced_cycles(lacking, again)
        w, past = self._window, len(self._positions)
        self._clocks = clocks = np.concatenate([self._clocks, clocks])
        self._positions = position = np.concatenate([self._positions, position])
        self._misplaced = misplaced = np.concatenate([self._misplaced, misplaced])
        self._judged = judged = np.concatenate([self._judged, judged])
        self._held = held = np.concatenate([self._held, held])
        excesses: list[Excess | None] = []
        if len(position) > w:
            # A clock that was set back in between says nothing; the other one then decides.
            elapsed = np.maximum(clocks[w:] - clocks[:-w], 0.5 * w * self._cycle)
            way = position[w:] - position[:-w]
            longest = elapsed.max(axis=1, keepdims=True)
            speed = np.abs(way) / longest
            feigned = self._resolution + speed * self._cycle * _sum_over(misplaced, w + 1)
            allowed = self._velocity_limit * self._velocity_margin + feigned / longest
            excesses.append(self._lasting(speed, allowed, judged[w:], past - w, "velocity", "/s"))
            if held.any():
                # Nothing has been commanded yet that is faster than the approach.
                slowly = self._velocity_limit * self._held_share + feigned / longest
                quantity = "velocity of the held axis"
                excesses.append(
                    self._lasting(speed, slowly, held[w:], past - w, quantity, "/s", self._held_share)
                )
            if len(position) > 2 * w:
                excesses.append(
                    self._beyond_acceleration(way, elapsed, misplaced, judged[2 * w :], past - 2 * w)
                )
        self._clocks, self._positions = clocks[-self._kept :], position[-self._kept :]
        self._misplaced, self._judged = misplaced[-self._kept :], judged[-self._kept :]
        self._held = held[-self._kept :]
        return [excess for excess in excesses if excess is not None]

    def _misplaced_cycles(self, lacking: NDArray[np.bool_], again: NDArray[np.bool_]) -> NDArray[np.int_]:
        """(M, n) by how many cycles a joint's positions may have fallen behind or caught up in a row."""
        cycles = lacking.astype(int)
        if not (lacking.any() or again.any()):
            return cycles
        for drive in range(lacking.shape[1]):
            # A drive catches up at most by what has lacked since it last did.
            behind = self._behind[drive] + cycles[:, drive].cumsum()
            caught_up = 0
            for row in np.flatnonzero(again[:, drive]):
                cycles[row, drive] += behind[row] - caught_up
                caught_up = behind[row]
            self._behind[drive] = min(behind[-1] - caught_up, 2 * self._window)
        return np.max(cycles[:, None, :] * self._needs, axis=2)

    def _beyond_acceleration(
        self, way: Array, elapsed: Array, misplaced: NDArray[Any], judged: NDArray[Any], old: int
    ) -> Excess | None:
        w = self._window
        cycles = _sum_over(misplaced, 2 * w + 1)
        smallest, allowed = np.inf, np.zeros(1)
        for clock in (0, 1):
            span = elapsed[:, clock : clock + 1]
            velocity = way / span
            between = 0.5 * (span[w:] + span[:-w])
            acceleration = np.abs(velocity[w:] - velocity[:-w]) / between
            speed = np.maximum(np.abs(velocity[w:]), np.abs(velocity[:-w]))
            feigned = (4 * self._resolution + 2 * speed * self._cycle * cycles) / between**2
            smallest = np.minimum(smallest, acceleration)
            allowed = np.maximum(allowed, feigned)
        allowed = allowed + self._acceleration_limit * self._acceleration_margin
        return self._lasting(np.asarray(smallest), allowed, judged, old, "acceleration", "/s²")

    def _lasting(
        self,
        value: Array,
        allowed: Array,
        judged: NDArray[Any],
        old: int,
        what: str,
        per: str,
        share: float = 1.0,
    ) -> Excess | None:
        """The first place where a value (R, n) is beyond what is allowed in `LASTING` rows in a row.

        old : how many of the R rows were there before the present block (less than none where rows lack)
        """
        with np.errstate(invalid="ignore"):
            beyond = (value > allowed) & judged[:, None]
        if not beyond.any() or len(beyond) < LASTING:
            return None
        ends = np.lib.stride_tricks.sliding_window_view(beyond, LASTING, axis=0).all(axis=-1)
        # Entry i of `ends` tells of row i + LASTING - 1; those before the block were judged already.
        skipped = max(0, old - LASTING + 1)
        places = np.flatnonzero(np.asarray(ends)[skipped:].ravel())
        if not len(places):
            return None
        first, axis = divmod(int(places[0]), beyond.shape[1])
        row = first + skipped + LASTING - 1
        limit = share * (self._acceleration_limit if what == "acceleration" else self._velocity_limit)[axis]
        unit = self._units[axis]
        sentence = f"{what} {excess_in_words(value[row, axis], limit, unit + per)}"
        return Excess(row - old, axis, sentence)


def _sum_over(flags: NDArray[Any], length: int) -> NDArray[Any]:
    """(N - length + 1, n) sums of each `length` rows in a row."""
    total = np.concatenate([np.zeros((1, flags.shape[1]), int), flags.cumsum(axis=0)])
    return total[length:] - total[:-length]
