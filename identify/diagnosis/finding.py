"""How one candidate fares beside a model, and whether the evidence is enough to call it missing."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from identify.diagnosis.candidates import Candidate
from identify.diagnosis.closed_loop import LoopEvidence
from identify.diagnosis.evidence import GroupEvidence
from identify.diagnosis.held_out import HeldOut

SIGNIFICANCE = 0.01
"""probability, corrected for all candidates and constants tried, below which evidence counts"""
LEAST_DROP = 0.015
"""An effect must lower the held-out error of its joint by at least this part of it: what is smaller no operator would
call missing, and small systematic errors of filters and encoders lie below it."""
LEAST_OF_TORQUE = 2.5e-4
"""Part of the joint's torque (root mean square) that an effect must explain: below lies what filters, stops and the
rounding of encoders leave, on the quietest of machines."""
DROP_PER_PARAMETER = 0.0025
"""How much more each further parameter or constant must bring."""
ACTS = 0.1
"""Part of the power in the fold where an effect acts most, with which it acts in a fold: only these are asked."""
FEWEST_FOLDS = 3
"""folds whose agreement gives a standard error: in fewer an effect that acts is not called missing"""
PLAIN_DROP = 0.05
STEADY = 1.8
"""A smaller drop must be this many standard errors over the folds (one-sided, 5 % at nine degrees of freedom): some
stretches with what is left of a reversal or a stop must not speak for all."""
AS_GOOD, SLIGHTLY_MORE = 0.99, 0.1
"""With this part of the best gain, and no more than this part more of the squared error left, a candidate is as good
whatever the evidence: what a large effect leaves of its own approximation, a more flexible candidate takes up."""
TOO_SMALL = 0.004
"""part of the squared held-out error that is left, by which one candidate may do better without being preferred"""


def led_by(gain: float, best: float) -> float:
    """Part of the squared error left by which the best of two candidates may lead and the other is as good."""
    return SLIGHTLY_MORE if gain >= AS_GOOD * best else TOO_SMALL


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
        left = 1 - LEAST_DROP - DROP_PER_PARAMETER * (self.complexity - 1)
        return max((1 - max(left, 0.0) ** 2) * self.before.total, LEAST_OF_TORQUE**2 * self.measured)

    @property
    def justified(self) -> bool:
        """Whether the evidence is enough to call the effect missing."""
        return bool(
            self.gain >= self.least_gain
            and self.p_value < SIGNIFICANCE
            and (self.loop is None or self.loop.p_value < SIGNIFICANCE)
            and self.acts.sum() >= FEWEST_FOLDS
            and float(np.mean((self.after.fold < self.before.fold)[self.acts])) > 0.5  # most of them
            and (self.drop >= PLAIN_DROP or self.steadiness >= STEADY)
            and self.sessions_agree
        )

    @property
    def acts(self) -> NDArray[np.bool_]:
        """(folds,) where the effect acts at all: what is over after a while must not be asked of the rest. What acts mostly in
        one or two, such as a cube of the speed, is asked in those where it acts most."""
        power = self.after.power
        enough = np.sort(power)[-FEWEST_FOLDS:][0]
        return (power > 0) & (power >= min(ACTS * power.max(), enough))

    @property
    def steadiness(self) -> float:
        """Mean gain of the folds in which it acts, in standard errors: a few stretches may not speak for all."""
        gain = (self.before.fold - self.after.fold)[self.acts]
        if len(gain) < FEWEST_FOLDS:
            return 0.0
        error = float(np.std(gain, ddof=1)) / np.sqrt(len(gain))
        return float(gain.mean()) / max(error, 1e-300)
