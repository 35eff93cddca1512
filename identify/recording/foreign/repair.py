"""Samples without a value and time stamps that do not increase: refused, left out, or bridged on request."""

from __future__ import annotations

from typing import Literal

import numpy as np
from numpy.typing import NDArray

from identify.recording.errors import InputError
from identify.recording.foreign.table import Clock
from identify.recording.sampling import SHORTEST_SEGMENT, SLOWEST_SAMPLING, largest_bridged_step

Array = NDArray[np.float64]
Repair = Literal["drop", "bridge"]
FASTEST_SAMPLING = 1e-6
"""s; no servo drive is sampled faster than some ten microseconds."""

_FEW_COMPLETE = 0.1
"""share of rows that hold all values, below which rows are of one signal each"""
_SPARSEST = 4.0
"""mean steps between rows that may lie between two values of a column: some loggers write a row for each signal"""


def refuse_coarse_clock(time: Array, clock: Clock, column: str, repair: Repair | None) -> None:
    """Refuse a time column most of whose stamps repeat, as of seconds since 1970 in single precision or with %g.

    time   : (N,) s
    column : file and name of the column, for the message

    With a repair it is refused only where too few stamps are left to repair anything with.

    Raises InputError: says how many digits are needed.
    """
    known = time[np.isfinite(time)]
    different = len(np.unique(known))
    if 2 * different > len(known) or (repair is not None and different >= SHORTEST_SEGMENT):
        return
    epoch = clock.begin is not None and not clock.of_day
    needed = " (in seconds since 1970, 14 digits are 0.1 ms; single precision has 7)" if epoch else ""
    more = ", or leave repeated samples out by --repair drop, or space them evenly by --repair bridge"
    raise InputError(
        f"{column}: {len(known)} samples have {different} different time{'s' if different > 1 else ''}: digits were"
        f" lost when it was written{needed}, or it is not the time; export it with more digits, or give --rate HZ"
        f" instead of --time"
        f"{'' if different < SHORTEST_SEGMENT else more}"
    )


def refuse_other_unit(time: Array, column: str) -> None:
    """Refuse a time column whose typical step no record of a motion has: its numbers are in another unit, or count samples.

    time   : (N,) s, increasing, N > 1
    column : file and name of the column, for the message

    Raises InputError: says which option helps.
    """
    steps = np.diff(time)
    step = float(np.median(steps))
    if step > SLOWEST_SAMPLING:
        counts = bool((steps == 1.0).all())
        raise InputError(
            f"{column}: the typical step is {step:g} s, too long for a motion; "
            + (
                "if it numbers the samples, give --rate HZ instead of --time; if it is a time, its --time-unit"
                if counts
                else "give its --time-unit (ms, us, ns)"
            )
        )
    if step < FASTEST_SAMPLING:
        raise InputError(
            f"{column}: the typical step is {step:.3g} s, too short for a motion; give its --time-unit (d for days, as"
            " spreadsheets count them)"
        )


def repaired_stamps(time: Array, repair: Repair) -> tuple[Array, NDArray[np.intp], list[str]]:
    """Increasing times, the rows that they belong to, and what was done, in words.

    drop   : a sample that does not come after all before it is left out
    bridge : stamps that repeat are spaced evenly up to the next one, as a clock coarser than the sampling makes them;
             where time goes back, all later stamps are moved to one typical step after the sample before
    """
    rows = np.arange(len(time))
    steps = np.diff(time)
    if (steps > 0).all():
        return time, rows, []
    repeated, back = int((steps == 0).sum()), int((steps < 0).sum())
    what = " and ".join(
        description
        for count, description in (
            (repeated, _count(repeated, "stamp repeats")),
            (back, _count(back, "step back in time")),
        )
        if count
    )
    if repair == "drop":
        latest = np.maximum.accumulate(time)
        kept = np.concatenate([[True], time[1:] > latest[:-1]])
        left_out = int((~kept).sum())
        return time[kept], rows[kept], [f"{what}: {left_out} of {len(time)} samples left out"]
    typical = float(np.median(steps[steps > 0])) if (steps > 0).any() else 0.0
    moved = np.concatenate([[0.0], np.cumsum(np.where(steps < 0, typical - steps, 0.0))])
    new = time + moved
    if repeated:
        distinct = np.flatnonzero(np.concatenate([[True], np.diff(new) > 0]))
        at = new[distinct]
        mean = (at[-1] - at[0]) / max(distinct[-1] - distinct[0], 1)
        ends = np.append(distinct, len(new))
        at = np.append(at, at[-1] + (len(new) - distinct[-1]) * mean)
        new = np.interp(np.arange(len(new)), ends, at)
    done = ["spaced evenly"] if repeated else []
    done += [f"later stamps moved on by {float(moved[-1]):.6g} s in all"] if back else []
    return new, rows, [f"{what}: {', '.join(done)}"]


def bridged(time: Array, values: Array) -> tuple[Array, NDArray[np.bool_], int]:
    """Values with short gaps (NaN) interpolated linearly in time, the rows that are usable then, samples bridged.

    time : (N,) s, increasing; values : (N, k)

    Where hardly a row has all values, as of a logger that writes a row for each signal, the rows of the signal that has most are
    the samples.
    """
    filled = values.copy()
    known_at = np.isfinite(values)
    usable = np.ones(len(time), dtype=bool)
    if known_at.all(axis=1).sum() < _FEW_COMPLETE * len(time):
        usable = known_at[:, int(np.argmax(known_at.sum(axis=0)))].copy()
    count = 0
    shortest = largest_bridged_step(_typical(time))
    mean = float(time[-1] - time[0]) / max(len(time) - 1, 1)
    for column in filled.T:
        known = np.isfinite(column)
        if known.all():
            continue
        if not known.any():
            return filled, np.zeros(len(time), dtype=bool), 0
        places = np.flatnonzero(known)
        longest = max(shortest, largest_bridged_step(min(_typical(time[places]), _SPARSEST * mean)))
        gaps = np.flatnonzero(~known)
        after = np.searchsorted(places, gaps)
        inside = (after > 0) & (after < len(places))
        before = places[np.clip(after - 1, 0, None)]
        behind = places[np.clip(after, None, len(places) - 1)]
        near = inside & (time[behind] - time[before] <= longest)
        column[gaps[near]] = np.interp(time[gaps[near]], time[places], column[places])
        bridging = gaps[near & usable[gaps]]
        usable[gaps[~near]] = False
        count += len(bridging)
    return filled, usable, count


def _typical(time: Array) -> float:
    return float(np.median(np.diff(time))) if len(time) > 1 else 0.0


def _count(count: int, description: str) -> str:
    noun, _, rest = description.partition(" ")
    if count == 1:
        return f"1 {description}"
    return f"{count} {noun}s {rest.replace('repeats', 'repeat')}"
