"""When a plan is looked at so that its picture is smooth: finely where its motion is new, and not again where it repeats."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from daq.excitation.excitation_plan import ExcitationPlan

Array = NDArray[np.float64]

POINTS = 6000
"""of a short plan"""
COARSEST = 0.1
"""s between points of a long one: a tenth of the period of the fastest motion that plans have"""


@dataclass(frozen=True)
class PreviewTimes:
    """Times at which a plan is evaluated, and where each of them stands in the whole.

    new     : (N,) s; a motion that repeats exactly is there once, so that what is left runs on without a jump
    spacing : s between them, but for what was left out
    whole   : (M,) s, all of the plan
    row     : (M,) which of the new times has the same motion
    """

    new: Array
    spacing: float
    whole: Array
    row: NDArray[np.intp]


def preview_times(plan: ExcitationPlan) -> PreviewTimes:
    """The times for a plan; both of its ends are among them."""
    repeats = [
        (begin, period, int(np.floor((end - begin) / period + 1e-9))) for begin, end, period in plan.repeated
    ]
    left_out = sum((times - 1) * period for _, period, times in repeats)
    length = plan.duration - left_out
    count = max(POINTS, int(np.ceil(length / COARSEST)) + 1)
    new = np.linspace(0.0, length, count)
    whole, row = [], []
    done = 0
    for begin, period, times in repeats:
        # What was left out before lies behind: from here on the plan is later than the even times are.
        before, once = np.searchsorted(new, [begin, begin + period])
        new[once:] += (times - 1) * period
        whole.append(new[done:before])
        row.append(np.arange(done, before))
        for turn in range(times):
            whole.append(new[before:once] + turn * period)
            row.append(np.arange(before, once))
        done = once
    whole.append(new[done:])
    row.append(np.arange(done, count))
    return PreviewTimes(new, length / (count - 1), np.concatenate(whole), np.concatenate(row))
