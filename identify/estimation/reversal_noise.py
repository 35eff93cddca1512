"""What is not known of the instants at which dry friction turns, as a weight of the samples around them."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from identify.estimation.context import FittedTorque, JointContext, slot_rows
from identify.signals import MotionBlock

Array = NDArray[np.float64]

LATEST = 0.1
"""s; an instant of reversal is never taken to be less well known than this"""


@dataclass(frozen=True)
class ReversalNoise:
    """What is not known of the instant of a reversal, for weighting the samples around it.

    Dry friction steps from one side to the other when dq changes its sign. The instant is known to a sample period,
    and to what the rounding of the encoder leaves; the step's error, through the parallel filter, stands beside
    `deviation`, the residual's own. Samples around a reversal then count as much less as their error is larger.

    deviation, speed : (n,) N m, rad/s
    """

    deviation: Array
    speed: Array

    def weights(self, block: MotionBlock, joint: int, dry: Array) -> Array:
        """(M,) weight of each decimated sample of a joint; `dry` (N,) is its fitted dry friction."""
        dq, ddq = block.dq[:, joint], block.ddq[:, joint]
        direction = np.sign(dq)
        turns = np.flatnonzero(direction[1:] * direction[:-1] < 0) + 1
        error = np.zeros((len(dq), 1))
        late = np.hypot(
            block.sampling_period / np.sqrt(12), self.speed[joint] / np.maximum(abs(ddq[turns]), 1e-9)
        )
        late = np.minimum(late, LATEST)
        step = np.abs(dry[turns] - dry[np.maximum(turns - 1, 0)])
        error[turns, 0] = step * late / block.sampling_period
        spread = block.decimate(error)[:, 0] / max(float(self.deviation[joint]), 1e-30)
        return 1.0 / np.sqrt(1.0 + spread**2)


def dry_friction(context: JointContext, fitted: FittedTorque | None) -> Array:
    """(N, n): the part of the fitted torque that turns with the sign of the velocity."""
    torque = np.zeros(context.load.shape)
    for slot, values in () if fitted is None else fitted.factors:
        if slot.term.effect.group in ("dry friction", "load"):
            for joint, columns in slot_rows(context, slot):
                torque[:, joint] += columns @ values
    return torque
