"""A ladder of speeds: trapezoidal moves from 1 % to 100 % of every joint's speed, both ways, all over the
range.

On each rung every joint cruises at the same share of its limit, up and down around several places of its
range, so that driving and back-driving both occur wherever gravity loads the joint both ways (Fig. 2 of the
paper). The rungs share the time alike: at 1 % of its speed a joint creeps over a small stretch, at 100 % it
crosses what the range allows. Joints change direction and place in different orders, so that their motions
do not run in parallel.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from daq.excitation.blend import Array
from daq.excitation.trapezoid import Move, move_at, quickest_ramp
from daq.rig import Rig

RUNGS = (0.01, 0.02, 0.035, 0.06, 0.1, 0.2, 0.35, 0.6, 1.0)
"""shares of the highest speed; closer together where the Stribeck effect bends the friction curve"""

PLACES = 3
"""places of the range at which a joint climbs the rungs: low, middle, high"""

LADDERS = ((RUNGS, PLACES), (RUNGS[::2], PLACES), (RUNGS[::2], 2), (RUNGS[::4], 2))
"""(rungs, places) of ladders, from the full one to the shortest that still has slow and fast, low and high"""

SHORTEST_CRUISE = 0.3
"""s at constant speed on a rung, each way; the filters that estimate the velocity need some samples on
the plateau
"""

TRANSIT = 0.8
"""share of the highest speed on the way from place to place"""

MARGIN = 0.98
"""of every limit that a plan uses; the rest is for the servo's overshoot and rounding"""


@dataclass(frozen=True)
class Reach:
    """What the plan may use of a rig, (n,) each, in joint space."""

    low: Array
    high: Array
    velocity: Array
    acceleration: Array
    jerk: Array

    @classmethod
    def of(cls, rig: Rig, margin: float = MARGIN, dynamic_share: float = 1.0) -> "Reach":
        """The limits of a rig, less a margin; of the dynamic ones only a share."""
        limits = [axis.limits for axis in rig.axes]
        low = np.array([limit.position[0] for limit in limits])
        high = np.array([limit.position[1] for limit in limits])
        middle, half = 0.5 * (low + high), 0.5 * (high - low) * margin
        return cls(
            low=middle - half,
            high=middle + half,
            velocity=dynamic_share * margin * np.array([limit.velocity for limit in limits]),
            acceleration=dynamic_share * margin * np.array([limit.acceleration for limit in limits]),
            jerk=dynamic_share * margin * np.array([limit.jerk for limit in limits]),
        )

    @property
    def middle(self) -> Array:
        """(n,) centre of the range."""
        return 0.5 * (self.low + self.high)


def speed_ladder(reach: Reach, start: Array, seconds: float, seed: int = 0) -> tuple[Move, ...]:
    """Moves that climb the ladder in at most `seconds`, from `start` (n,) and back to it.

    The time at each speed is found by bisection. Where the time is too short for all rungs, rungs and then
    places are left out; where it is too short even so, the shortest ladder is returned and lasts longer.
    """

    def lasts(moves: tuple[Move, ...]) -> float:
        return sum(move.duration for move in moves)

    rungs, places = LADDERS[-1]
    best: tuple[Move, ...] = ()
    for rungs, places in LADDERS:
        best = _ladder(reach, start, SHORTEST_CRUISE, rungs, places, seed)
        if lasts(best) <= seconds:
            break
    else:
        return best
    shortest, longest = SHORTEST_CRUISE, max(seconds, 2.0 * SHORTEST_CRUISE)
    for _ in range(18):
        middle = 0.5 * (shortest + longest)
        moves = _ladder(reach, start, middle, rungs, places, seed)
        if lasts(moves) <= seconds:
            shortest, best = middle, moves
        else:
            longest = middle
    return best


def _ladder(
    reach: Reach, start: Array, cruise: float, rungs: tuple[float, ...], places: int, seed: int
) -> tuple[Move, ...]:
    """A ladder with about `cruise` seconds at each speed, place and direction.

    Rungs whose stretch is shorter than half the range are climbed at every place, all of them before the next
    transit; the faster rungs cross the range once each way.
    """
    random = np.random.default_rng(seed)
    n = len(start)
    range_ = reach.high - reach.low
    moves: list[Move] = []
    position = np.array(start, dtype=float)

    def go(to: Array, share: float) -> None:
        nonlocal position
        if np.abs(to - position).max() > 1e-9:
            moves.append(move_at(position, to, share * reach.velocity, reach.acceleration, reach.jerk))
            position = np.array(to, dtype=float)

    def there_and_back(place: Array, stretch: Array, upwards: NDArray[np.bool_], share: float) -> None:
        low = reach.low + place * (range_ - stretch)
        begin, end = np.where(upwards, low, low + stretch), np.where(upwards, low + stretch, low)
        go(begin, TRANSIT)
        go(end, share)
        go(begin, share)

    def stretch_of(share: float) -> Array:
        speed = share * reach.velocity
        ramp = quickest_ramp(speed, reach.acceleration, reach.jerk)
        return np.minimum(speed * (cruise + ramp), range_)

    slow = [share for share in rungs if np.max(stretch_of(share) / range_) < 0.5]
    where = np.array([random.permutation(places) for _ in range(n)]).T / (places - 1)
    if n == 1:
        where = np.sort(where, axis=0)
    for place in where:
        for share in slow:
            upwards = random.random(n) < 0.5
            there_and_back(place, stretch_of(share), upwards, share)
    for share in rungs[len(slow) :]:
        upwards = random.random(n) < 0.5
        there_and_back(0.5 * np.ones(n), stretch_of(share), upwards, share)
    go(np.array(start, dtype=float), TRANSIT)
    return tuple(moves)
