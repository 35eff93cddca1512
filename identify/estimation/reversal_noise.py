"""What is not known of the instants at which dry friction turns, as a weight of the samples around them."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from identify.estimation.context import FittedTorque, JointContext, slot_rows
from identify.signals import MotionBlock
from identify.signals.running_extremes import running_maximum

Array = NDArray[np.float64]

LATEST = 0.1
"""s; an instant of reversal is never taken to be less well known than this"""


@dataclass(frozen=True, eq=False)
class ReversalNoise:
    """What is not known of the instant of a reversal, for weighting the samples around it.

    Dry friction steps from one side to the other when the joint turns round. The instant is known to a sample period,
    to what the rounding of the encoder leaves, and to what the recorded positions say of it (`signals.reversals`); the
    step's error, through the parallel filter, stands beside `deviation`, the residual's own. Samples around a reversal
    then count as much less as their error is larger.

    deviation, speed : (n,) N m, rad/s
    """

    deviation: Array
    speed: Array

    def weights(self, block: MotionBlock, joint: int, dry: Array) -> Array:
        """(M,) weight of each decimated sample of a joint; `dry` (N,) is its fitted dry friction."""
        ddq = block.ddq[:, joint]
        heading = np.sign(block.direction[:, joint])
        moving = np.flatnonzero(heading)
        turns = moving[1:][heading[moving[1:]] != heading[moving[:-1]]]
        deviation = _deviation(block, joint, turns)
        late = np.hypot(
            block.sampling_period / np.sqrt(12), self.speed[joint] / np.maximum(abs(ddq[turns]), 1e-9)
        )
        late = np.minimum(np.hypot(late, deviation), LATEST)
        # the direction passes from one side to the other within root three deviations
        around = 1 + np.ceil(np.sqrt(3.0) * deviation / block.sampling_period).astype(int)
        step = np.abs(dry[np.minimum(turns + around, len(dry) - 1)] - dry[np.maximum(turns - around, 0)])
        error = np.zeros((len(ddq), 1))
        error[turns, 0] = step * late / block.sampling_period
        spread = block.decimate(error)[:, 0] / max(float(self.deviation[joint]), 1e-30)
        return 1.0 / np.sqrt(1.0 + spread**2)


def _deviation(block: MotionBlock, joint: int, turns: NDArray[np.intp]) -> Array:
    """s, of the instants that were found beside the recorded positions; 0 at the other turns."""
    reversals = block.reversals[joint]
    deviation = np.zeros(len(block.dq))
    rows = np.clip(np.ceil(reversals.instant).astype(int), 0, len(deviation) - 1)
    deviation[rows] = reversals.deviation * block.sampling_period
    return running_maximum(deviation, 3)[turns]


def dry_friction(context: JointContext, fitted: FittedTorque | None) -> Array:
    """(N, n): the part of the fitted torque that turns with the sign of the velocity."""
    torque = np.zeros(context.load.shape)
    for slot, values in () if fitted is None else fitted.factors:
        if slot.term.effect.group in ("dry friction", "load"):
            for joint, columns in slot_rows(context, slot):
                torque[:, joint] += columns @ values
    return torque
