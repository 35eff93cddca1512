"""How one candidate fares beside a model, and whether the evidence is enough to call it missing."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from identify.diagnosis.candidates import Candidate
from identify.diagnosis.closed_loop import LoopEvidence
from identify.diagnosis.deciding_constants import (
    DROP_PER_PARAMETER,
    FEWEST_FOLDS,
    LEAST_DROP,
    LEAST_OF_TORQUE,
    LEAST_SHARE,
    MOST,
    SIGNIFICANCE,
)
from identify.diagnosis.evidence import GroupEvidence
from identify.diagnosis.held_out import HeldOut
from identify.estimation.statistics import NORMAL

Array = NDArray[np.float64]


def gained(drop: float) -> float:
    """Part of the squared error that is gained where the error drops by a part of it."""
    return 1 - max(1 - drop, 0.0) ** 2


@dataclass(frozen=True)
class Finding:
    """How one candidate fares beside the present model.

    before, after   : held-out squared error of the joint without and with it
    comparable_gain : how far it lowers that error beside the model that all candidates can be compared with; once a
                      declared load is in doubt, that with all payloads as declared: the payload ratio that the others
                      are judged beside does the work of such an effect
    loop            : what instruments say, of an effect made of derivatives
    estimated       : its parameters on all motion, where it lowers the error
    """

    candidate: Candidate
    variant: int
    before: HeldOut
    after: HeldOut
    comparable_gain: float
    measured: float
    p_value: float
    complexity: int
    sessions_agree: bool
    loop: LoopEvidence | None = None
    estimated: GroupEvidence | None = None

    @property
    def gain(self) -> float:
        """Drop of the held-out squared error; as far as the effect accounts for it where instruments were asked."""
        return (self.before.total - self.after.total) * (1.0 if self.loop is None else self.loop.part)

    @property
    def drop(self) -> float:
        """Drop of the held-out error, part of it."""
        left = self.before.total - self.gain
        return 1 - float(np.sqrt(max(left, 0.0) / max(self.before.total, 1e-300)))

    def relative(self, square: float) -> float:
        """Of the joint's measured torque, the root of a squared error."""
        return float(np.sqrt(max(square, 0.0) / max(self.measured, 1e-300)))

    @property
    def least_gain(self) -> float:
        """How far it must lower the squared held-out error to be any operator's business."""
        drop = LEAST_DROP + DROP_PER_PARAMETER * (self.complexity - 1)
        return max(gained(drop) * self.before.total, LEAST_OF_TORQUE**2 * self.measured)

    @property
    def justified(self) -> bool:
        """Whether the evidence is enough to call the effect missing."""
        return bool(
            self.gain >= self.least_gain
            and self.p_value < SIGNIFICANCE
            and (self.loop is None or self.loop.p_value < SIGNIFICANCE)
            and self.steady
            and self.sessions_agree
        )

    @property
    def steady(self) -> bool:
        """Whether it lowers the error of the stretches in which it acts, and not of a few of them."""
        return steady(self.before, self.after)


def steady(before: HeldOut, after: HeldOut) -> bool:
    """Whether the error falls where the effect acts, and not by a few stretches only.

    Folds count by the power with which the effect acts in them, so that what is over after a while is not asked of the rest: it
    must gain where most of its power is. What is less than structure (`LEAST_SHARE` of the error's power) must be steady as well:
    what is gained in a fold is a part of the effect's power there, of the cause about all of it, and that part, Σ gain / Σ power,
    must be `NORMAL` of its standard errors over the folds (a ratio estimate; Cochran, Sampling techniques, 1977, ch. 6). Of
    `FEWEST_FOLDS` or less, as many as carry so much power alike, nothing of this is known (effective number of clusters:
    Carter, Schnepel, Steigerwald 2017). The strongest is then one witness that must not speak against it, and all of this is
    asked of the others, which a disturbance of that stretch does not reach: motion that goes where no other stretch does has most
    of the power of what acts there, though it acts everywhere.
    """
    gain, power, error = before.fold - after.fold, after.power, before.fold
    while (folds := _effective(power)) <= FEWEST_FOLDS:
        strongest = int(np.argmax(power))
        if folds == 0.0 or gain[strongest] <= 0:
            return False
        gain, power, error = (np.delete(each, strongest) for each in (gain, power, error))
    if float(power[gain > 0].sum()) <= MOST * float(power.sum()):
        return False
    scatter = gain - float(gain.sum() / power.sum()) * power
    deviation = np.sqrt(float(scatter @ scatter) * folds / (folds - 1))
    return bool(gain.sum() > min(NORMAL * deviation, LEAST_SHARE * error.sum()))


def _effective(power: Array) -> float:
    """How many folds carry the power, were each to carry as much; 0 where there is none."""
    squares = float(power @ power)
    return float(power.sum()) ** 2 / squares if squares > 0.0 else 0.0
