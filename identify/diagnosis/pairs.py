"""Two effects of a joint that only help together."""

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import combinations

import numpy as np
from numpy.typing import NDArray

from identify.diagnosis.candidates import Candidate
from identify.diagnosis.deciding_constants import LEAST_DROP, LEAST_OF_TORQUE, SIGNIFICANCE
from identify.diagnosis.evidence import group_evidence
from identify.diagnosis.finding import Finding, steady
from identify.diagnosis.held_out import FoldedProducts, Trial
from identify.estimation.observation import Observation

Index = NDArray[np.intp]
Addition = tuple[Candidate, int]
"""A candidate, and the variant of its constants."""
Choice = tuple[float, list[Addition]]
"""What is to be added to a joint, and the drop of its error."""

PAIRED = 10
"""Best candidates of which all pairs are tried when no single one is justified."""


@dataclass(frozen=True)
class Pairs:
    """Pairs of a joint's candidates.

    motion : products of the columns, by folds of motion
    base   : columns beside which they are judged
    tried  : number of the joint's candidates, for the correction of the evidence
    """

    observation: Observation
    motion: FoldedProducts
    joint: int
    base: Index
    tried: int

    def strong(self, findings: Sequence[Finding], least: float) -> list[Choice]:
        """Pairs of the best candidates that lower the error by so much on motion that the fit did not see, the strongest first.
        Whether noise could do it is not asked yet.

        findings : the joint's candidates, the best first
        least    : the gain that they must have together
        """
        listed = [f for f in findings if f.candidate.beside_ratio][:PAIRED]
        if len(listed) < 2:
            return []
        pairs = [[(f.candidate, f.variant) for f in pair] for pair in combinations(listed, 2)]
        trials = [Trial((np.concatenate([self._columns(*each) for each in pair]),)) for pair in pairs]
        before = self.motion.alone(self.joint, self.base)
        after = self.motion.evaluate(self.joint, self.base, trials)
        least = max(least, LEAST_OF_TORQUE**2 * self.motion.measured(self.joint))
        choices: list[Choice] = []
        for pair, fared in zip(pairs, after, strict=True):
            drop = 1 - float(np.sqrt(max(fared.total, 0) / max(before.total, 1e-300)))
            if before.total - fared.total >= least and drop >= 2 * LEAST_DROP and steady(before, fared):
                choices.append((drop, pair))
        return sorted(choices, key=lambda choice: choice[0], reverse=True)

    def holds(self, pair: Sequence[Addition]) -> bool:
        """Whether each of two effects explains something beside the other, with values that it can have, and both together
        more than noise does."""
        for (candidate, variant), other in zip(pair, pair[::-1], strict=True):
            beside = np.union1d(self.base, self._columns(*other))
            tested = np.setdiff1d(self._columns(candidate, variant), beside)
            evidence = group_evidence(self.observation, self.joint, beside, tested)
            if evidence.p_value * candidate.searched * self.tried >= SIGNIFICANCE:
                return False
            if candidate.outside(evidence.estimates, variant).any():
                return False
        together = np.setdiff1d(np.concatenate([self._columns(*each) for each in pair]), self.base)
        tried = self.tried**2 * int(np.prod([candidate.searched for candidate, _ in pair]))
        p_value = group_evidence(self.observation, self.joint, self.base, together).p_value
        return p_value * tried < SIGNIFICANCE

    def _columns(self, candidate: Candidate, variant: int) -> Index:
        return candidate.columns(self.observation, variant)
