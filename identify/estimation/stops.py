"""Where a joint stopped, and which decimated samples mix in a stop."""

import numpy as np
from numpy.typing import NDArray

from identify.signals import MotionBlock
from identify.signals.running_extremes import running_maximum, running_minimum

Array = NDArray[np.float64]

STOP_TIME = 0.01
"""s. A joint that stays below its rest speed for this long has stopped. What holds it then is any friction up to
the breakaway torque, of which sign(dq) says nothing (the stiction area of eq. 26). A reversal without a stop passes
the rest speed sooner."""

FILTER_REACH = 1.5
"""periods of the parallel filter's cut-off. With one period, samples between 1.0 and 1.4 periods from a stop had three times
the residual of the others, which moved F_V by four deviations on freshly planned motions; with two, less is left and no
parameter gets better"""


def stopping_speed(block: MotionBlock) -> Array:
    """(M, n + k): the speed below which a joint, or a shared motor, stayed for `STOP_TIME` at some time near each decimated
    sample.

    Near is the main lobe of the parallel filter: half a period of its cut-off to either side.
    """
    stay, reach = _stay(block), _odd(1.0 / (block.cutoff * block.sampling_period))
    held_below = running_maximum(np.abs(with_motors(block.dq, block.shared)), stay)
    return block.at_decimated(running_minimum(held_below, reach))


def recorded_stopping_speed(block: MotionBlock) -> Array:
    """(M, n + k): the same by the way that the positions as recorded went within `STOP_TIME`.

    A joint stops with a corner in its velocity. The position filter rounds the corner and rings behind it, so that
    the filtered velocity may stay above the rest speed throughout a short stop. A stop seen here is certain;
    near it are all samples that the parallel filter still mixes it into: `FILTER_REACH` to either side.
    """
    stay, reach = _stay(block), _odd(2.0 * FILTER_REACH / (block.cutoff * block.sampling_period))
    course = with_motors(block.position, block.shared)
    way = running_maximum(course, stay) - running_minimum(course, stay)
    return block.at_decimated(running_minimum(way, reach)) / ((stay - 1) * block.sampling_period)


def with_motors(values: Array, shared: Array | None) -> Array:
    """(N, n + k): positions or velocities of the joints, and beside them those of the motors that several joints share."""
    return values if shared is None else np.hstack([values, values @ shared])


def _stay(block: MotionBlock) -> int:
    return _odd(STOP_TIME / block.sampling_period)


def _odd(length: float) -> int:
    """The odd whole number of samples nearest to a length, at least 3."""
    return max(3, 2 * round(0.5 * (length - 1)) + 1)
