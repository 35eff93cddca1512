"""Where a recorded command stands at a limit: what the motor's torque was there is not in the record.

A drive, or the converter that its current is measured with, cuts what is asked of it at a largest value. The record then has
that value, exactly the same, for as long as more was asked for. Such samples say of the torque that it was at least so much,
or nothing, and are no equation of eq. (11).
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from identify.recording import Session

Array = NDArray[np.float64]

LEAST_RUN = 3
"""samples of one value after each other that stand"""
PIECE = 1 << 20
"""samples that are looked at together; a run that goes on in the next counts there as another one"""
OFTENER = 6.0
"""Times as many samples stand at a limit as at any other value. The topmost step of a rounded sine has up to 2.4 times as many as
the next, 1/(√2 − 1), that of a course as flat as t⁴ 5.3, 1/(2^¼ − 1)."""
SLOWEST = 10
"""samples to either side within which the encoder of a joint that moves takes a step"""
STRAIGHT = 2.0
"""steps of the encoder within which a position that runs evenly stays from the line between two of its samples"""


@dataclass(frozen=True, eq=False)
class Standing:
    """Values at which a command stands in a session, or a part of it, while its joint moves.

    values  : (k,) of the command, ascending
    samples : (k,) at each, in runs of `LEAST_RUN` or more
    uneven  : (k,) of these, samples of runs in which the joint's speed changes
    lowest, highest : of all samples
    at_lowest, at_highest : samples there, those that stand and single ones
    moving  : samples with a step of the encoder within `SLOWEST` of them
    """

    values: Array
    samples: NDArray[np.intp]
    uneven: NDArray[np.intp]
    lowest: float
    highest: float
    at_lowest: int
    at_highest: int
    moving: int

    def at(self, limits: tuple[float, float]) -> int:
        """Samples at a lower or an upper limit."""
        return self.at_lowest * (self.lowest == limits[0]) + self.at_highest * (self.highest == limits[1])


def standing_in_parts(
    session: Session, motor: int, joints: NDArray[np.intp], steps: Array
) -> tuple[Standing, ...]:
    """Where the command of a motor stands, in pieces of a session of which a few fit into memory.

    joints : (k,) that it turns
    steps  : (n,) smallest steps between the positions of every joint
    """
    return tuple(
        standing(
            np.asarray(session.command[first : first + PIECE, motor]),
            np.asarray(session.position[first : first + PIECE, joints]),
            steps[joints],
        )
        for first in range(0, len(session.time), PIECE)
    )


def standing(command: Array, positions: Array, steps: Array) -> Standing:
    """Where a command stands while one of its joints moves.

    command   : (N,) of one motor
    positions : (N, k) of the joints that it turns
    steps     : (k,) smallest steps between the positions
    """
    same = np.flatnonzero(np.diff(command) == 0)
    breaks = np.flatnonzero(np.diff(same) > 1)
    first = same[np.concatenate([[0], breaks + 1])] if len(same) else same
    last = same[np.concatenate([breaks, [len(same) - 1]])] + 1 if len(same) else same
    long = last - first + 1 >= LEAST_RUN
    first, last = first[long], last[long]
    moves = np.any(np.diff(positions, axis=0) != 0, axis=1)
    moved = np.concatenate([[0], np.cumsum(moves)])
    sample = np.arange(len(command))
    # a motor at rest stands at whatever holds it
    first, last = (ends[moved[last] > moved[first]] for ends in (first, last))
    middle = (first + last) // 2
    part = ((middle - first) / np.maximum(last - first, 1))[:, None]
    line = (1 - part) * positions[first] + part * positions[last]
    tolerance = STRAIGHT * np.where(np.isfinite(steps), steps, 0.0)
    uneven = np.any(np.abs(positions[middle] - line) > tolerance, axis=1)
    values, of_value = _distinct(command[first])
    lengths = last - first + 1
    return Standing(
        values,
        np.bincount(of_value, lengths, len(values)).astype(np.intp),
        np.bincount(of_value, lengths * uneven, len(values)).astype(np.intp),
        lowest := float(np.min(command)),
        highest := float(np.max(command)),
        int(np.sum(command == lowest)),
        int(np.sum(command == highest)),
        int(np.sum(moved[np.minimum(sample + SLOWEST, len(moves))] > moved[np.maximum(sample - SLOWEST, 0)])),
    )


def limits(sessions: Sequence[Standing]) -> tuple[float, float]:
    """The lowest and the highest value of a command if these are limits that cut it; −∞ and ∞ where not.

    sessions : of all sessions, or of parts of them

    A limit is the extreme of all sessions, and not 0, at which a drive is off. The command stands there `OFTENER` than
    anywhere else, which a rounded course does not, nor one that has several levels; mostly while the speed changes, so that
    it is not what friction asks for in even motion; and in less than half of the motion, so that it is not switched between
    two values. Where the other extreme is the opposite to the last digit, it is the same limit.
    """
    values = np.concatenate([each.values for each in sessions])
    samples, uneven = (
        np.concatenate([getattr(each, name) for each in sessions]) for name in ("samples", "uneven")
    )
    ends = min(each.lowest for each in sessions), max(each.highest for each in sessions)
    elsewhere = (values != ends[0]) & (values != ends[1])
    _, of_value = _distinct(values[elsewhere])
    most = np.bincount(of_value, samples[elsewhere]).max(initial=0)
    moving = sum(each.moving for each in sessions)
    cut = [
        end != 0.0
        and samples[values == end].sum() >= OFTENER * max(most, LEAST_RUN)
        and 2 * uneven[values == end].sum() > samples[values == end].sum()
        for end in ends
    ]
    if any(cut) and ends[0] == -ends[1]:
        cut = [True, True]
    at_cut = sum(int(samples[values == end].sum()) for end, is_cut in zip(ends, cut, strict=True) if is_cut)
    if ends[0] == ends[1] or 2 * at_cut > moving:
        return -np.inf, np.inf
    return (ends[0] if cut[0] else -np.inf), (ends[1] if cut[1] else np.inf)


def _distinct(values: Array) -> tuple[Array, NDArray[np.intp]]:
    """Each value once, ascending, and which of them every one is: `np.unique`, which imports all of `numpy.ma`."""
    order = np.argsort(values, kind="stable")
    ascending = values[order]
    new = np.concatenate([np.ones(min(len(values), 1), np.bool_), ascending[1:] != ascending[:-1]])
    places = np.empty(len(values), np.intp)
    places[order] = np.cumsum(new) - 1
    return ascending[new], places
