"""Positions that jump: counters and angles that wrap round, encoders that were set to a new zero, values that were held.

A joint cannot leave one place and stand in another within one sample. A step of position is taken for a jump where it is alone
among steps that are all much smaller; what the recorded values did there decides what is done about it. Works in blocks, so
that a session may be longer than memory.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from identify.recording.samples import RawSamples, SampleColumns, release

Array = NDArray[np.float64]
Mask = NDArray[np.bool_]

BLOCK = 1 << 18
"""Samples worked on at a time."""
LARGER = 10.0
"""Times the largest step of what moves beside it: a jump. Speed would have to rise so much and fall again in one sample."""
RARE = 0.01
"""Of all steps, at most so many can be jumps: where more are large, they are how the joint moves, or how it is sampled."""
LEAST_SHARE = 0.01
"""Of the range that the joint covers: a smaller step may be a joint that sticks and slips."""


@dataclass(frozen=True)
class PositionJumps:
    """What jumps were seen in the samples of a session, and what is left of them."""

    borders: tuple[int, ...]
    """The last row before each jump: the samples on both sides are not one motion."""
    held: tuple[slice, ...]
    """Rows that repeat one position until it jumps: it was held, not measured."""
    remarks: tuple[str, ...]


@dataclass(frozen=True)
class _Jumps:
    """The jumps of one joint."""

    rows: NDArray[np.intp]
    """The last row before each."""
    sizes: Array
    """rad or m, with sign, without what the joint moved meanwhile"""
    step: float
    """rad or m, the largest step of the motion itself"""
    resolution: float
    """rad or m, the smallest step"""


def mend_position_jumps(raw: RawSamples, period: float, longest: float) -> PositionJumps:
    """Undo what wraps round, in `raw`, and say where else the positions of a session jump.

    period : s, the typical step in time; longest : s, a longer one is a hole, across which nothing is compared.

    Angles that wrap at a turn and counters that wrap at their modulus are continued, on the branch whose mean is nearest to
    zero. Every other jump is a border between two motions.
    """
    borders: set[int] = set()
    held: list[slice] = []
    remarks: list[str] = []
    moduli: dict[int, tuple[_Jumps, float]] = {}
    for joint in range(raw.position.shape[1]):
        low, high = _range(raw.position, joint)
        jumps = _jumps(raw, joint, high - low, period, longest)
        if not len(jumps.rows):
            continue
        modulus = _modulus(jumps, high - low)
        if modulus is not None:
            moduli[joint] = jumps, modulus
            remarks.append(
                f"the position of joint {joint + 1} wraps round by {modulus:.6g} (after {_where(raw.time, jumps.rows)}):"
                " continued over it, with its mean nearest to zero"
            )
            continue
        before = [
            rows for row in jumps.rows if (rows := _held_until(raw.position, joint, int(row))) is not None
        ]
        borders.update(int(row) for row in jumps.rows)
        held.extend(before)
        remarks.append(_remark(raw.time, joint, jumps, sum(rows.stop - rows.start for rows in before)))
    if moduli:
        raw.position = _continued(raw.position, moduli)
    return PositionJumps(tuple(sorted(borders)), tuple(held), tuple(remarks))


def _remark(time: Array, joint: int, jumps: _Jumps, held: int) -> str:
    size = float(np.abs(jumps.sizes).max())
    said = f"the position of joint {joint + 1} jumps by up to {size:.3g} (after {_where(time, jumps.rows)}): split there"
    if held:
        return f"{said}, {held} samples before it that repeat one position left out"
    if abs(float(jumps.sizes.sum())) > LARGER * jumps.step:
        return f"{said}; if its zero was set anew, the positions on one side are not those of the robot: cut that part off"
    return said


def _where(time: Array, rows: NDArray[np.intp]) -> str:
    return ", ".join(f"{time[row]:.6g} s" for row in rows[:3]) + (" ..." if len(rows) > 3 else "")


def _blocks(rows: int) -> Iterator[slice]:
    """Blocks of rows, each with the first row of the next."""
    for first in range(0, rows, BLOCK):
        yield slice(first, min(first + BLOCK + 1, rows))


def _range(position: Array, joint: int) -> tuple[float, float]:
    low, high = math.inf, -math.inf
    for rows in _blocks(len(position)):
        values = position[rows, joint]
        low, high = min(low, float(values.min())), max(high, float(values.max()))
        release(position)
    return low, high


def _jumps(raw: RawSamples, joint: int, covered: float, period: float, longest: float) -> _Jumps:
    rows: list[NDArray[np.intp]] = []
    sizes: list[Array] = []
    step, resolution = 0.0, math.inf
    for block in _blocks(len(raw.time)):
        lapse = np.diff(raw.time[block])
        steps = np.diff(raw.position[block, joint]) / np.maximum(np.round(lapse / period), 1.0)
        steps[lapse > longest] = 0.0
        release(raw.position)
        size = np.abs(steps)
        if not size.any():
            continue
        resolution = min(resolution, float(size[size > 0].min()))
        jumping = _alone(steps) & (size >= LEAST_SHARE * covered)
        step = max(step, float(size[~jumping].max(initial=0.0)))
        at = np.flatnonzero(jumping)
        rows.append(block.start + at)
        sizes.append(steps[at] - _moved_meanwhile(steps, jumping, at))
    if not rows:
        return _Jumps(np.empty(0, np.intp), np.empty(0), step, resolution)
    return _Jumps(np.concatenate(rows), np.concatenate(sizes), step, resolution)


def _moved_meanwhile(steps: Array, jumping: Mask, at: NDArray[np.intp]) -> Array:
    """The step that the joint would have made at each jump: the mean of those beside it."""
    quiet = np.concatenate([[0.0], np.where(jumping, 0.0, steps), [0.0]])
    counted = np.concatenate([[0.0], ~jumping, [0.0]])
    both = quiet[at] + quiet[at + 2]
    return np.asarray(both / np.maximum(counted[at] + counted[at + 2], 1.0), np.float64)


def _alone(steps: Array) -> Mask:
    """(N,) which steps are jumps: much larger than all others, one at a time or to a place and back."""
    size = np.abs(steps)
    most = max(int(RARE * len(size)), 2)
    if len(size) <= most:
        return np.zeros(len(size), np.bool_)
    largest = np.sort(np.partition(size, -most - 1)[-most - 1 :])[::-1]
    below = np.maximum(largest[1:], size[size > 0].min())
    gaps = np.flatnonzero(largest[:-1] > LARGER * below)
    if not len(gaps):
        return np.zeros(len(size), np.bool_)
    large = size >= largest[gaps[-1]]
    rest = float(below[gaps[-1]])
    motion = rest
    changes = np.flatnonzero(np.diff(large, prepend=False, append=False))
    for first, last in changes.reshape(-1, 2):
        returns = abs(float(steps[first:last].sum())) <= LARGER * rest * (last - first)
        if last - first > 1 and not returns:
            motion = max(motion, float(size[first:last].max()))
    return np.asarray(large & (size > LARGER * motion), np.bool_)


def _modulus(jumps: _Jumps, covered: float) -> float | None:
    """By what the position wraps round; None if it does not.

    It does where the jumps lead from one end of all positions to the other, and are of one size, which a single one is not
    enough to tell: it is then a turn, or a power of two of the resolution.
    """
    sizes = np.abs(jumps.sizes)
    modulus, near = float(np.median(sizes)), 2.0 * jumps.step
    if float(np.abs(sizes - modulus).max()) > near or covered > modulus + near:
        return None
    if abs(modulus - 2 * math.pi) <= near:
        return 2 * math.pi
    counts = 2.0 ** round(math.log2(modulus / jumps.resolution)) * jumps.resolution
    if abs(modulus - counts) <= near:
        return counts
    return modulus if len(sizes) > 1 else None


def _held_until(position: Array, joint: int, row: int) -> slice | None:
    """The rows up to one that repeat the position of the row before them; None if the position moved until then."""
    first = row
    while first > 0 and position[first - 1, joint] == position[row, joint]:
        first -= 1
    return slice(first + 1, row + 1) if first < row else None


def _continued(position: Array, moduli: dict[int, tuple[_Jumps, float]]) -> Array:
    """Positions without their wraps, on the branch whose mean is nearest to zero."""
    turns = {joint: np.cumsum(-np.sign(jumps.sizes)) for joint, (jumps, _) in moduli.items()}
    lowest: dict[int, float] = {}
    for joint, (jumps, modulus) in moduli.items():
        total = 0.0
        for rows in _blocks(len(position)):
            inner = slice(rows.start, min(rows.start + BLOCK, rows.stop))
            total += float((position[inner, joint] + modulus * _turns(jumps, turns[joint], inner)).sum())
            release(position)
        lowest[joint] = -round(total / len(position) / modulus)
    columns = SampleColumns(position.shape[1])
    for first in range(0, len(position), BLOCK):
        inner = slice(first, min(first + BLOCK, len(position)))
        values = np.array(position[inner])
        for joint, (jumps, modulus) in moduli.items():
            values[:, joint] += modulus * (_turns(jumps, turns[joint], inner) + lowest[joint])
        columns.append(values)
        release(position)
    return columns.array()


def _turns(jumps: _Jumps, turns: Array, rows: slice) -> Array:
    """(rows,) how many wraps lie before each row, with sign."""
    before = np.searchsorted(jumps.rows, np.arange(rows.start, rows.stop), side="left")
    return np.concatenate([[0.0], turns])[before]
