"""Which effects are justified: forward, in pairs, and backward, by the error on motion that the fit did not see."""

from collections.abc import Sequence
from dataclasses import dataclass, field
from itertools import combinations, product

import numpy as np
from numpy.typing import NDArray

from identify.diagnosis.candidates import DECLARED_LOAD, Candidate
from identify.diagnosis.evidence import group_p_value
from identify.diagnosis.held_out import FoldedProducts, HeldOut, Trial, folds_of_motion, folds_of_sessions
from identify.estimation.observation import Observation

Array = NDArray[np.float64]
Index = NDArray[np.intp]

FOLDS = 10
"""stretches of every session left out in turn"""
SIGNIFICANCE = 0.01
"""probability, corrected for all candidates and constants tried, below which evidence counts"""
LEAST_DROP = 0.01
"""An effect must lower the held-out error of its joint by at least this part of it: what is smaller no operator would
call missing, and small systematic errors of filters and encoders lie below it."""
AS_GOOD = 0.97
"""A simpler candidate is preferred if its gain is at least this part of the best one's."""
RIVAL_GAIN = 0.85
"""A candidate with at least this part of the best gain may be the cause as well, if the folds do not decide."""
SUPERFLUOUS = 0.0025
"""Part of the held-out error that a term must be worth to stay."""
MOST_ADDED = 6
"""effects added to one joint; a record that asks for more is not understood"""


@dataclass(frozen=True)
class Finding:
    """How one candidate fares beside the present model.

    before, after : held-out squared error of the joint without and with it; trained_* the same on the fit's data
    """

    candidate: Candidate
    variant: int
    before: HeldOut
    after: HeldOut
    measured: float
    p_value: float
    complexity: int
    sessions_agree: bool
    rivals: tuple[str, ...] = ()

    @property
    def gain(self) -> float:
        """Drop of the held-out squared error."""
        return self.before.total - self.after.total

    @property
    def drop(self) -> float:
        """Drop of the held-out error, part of it."""
        return 1 - float(np.sqrt(max(self.after.total, 0.0) / max(self.before.total, 1e-300)))

    @property
    def justified(self) -> bool:
        """Whether the evidence is enough to call the effect missing."""
        improved = np.mean(self.after.fold < self.before.fold)
        return (
            self.drop >= LEAST_DROP
            and self.p_value < SIGNIFICANCE
            and improved >= 0.6
            and self.sessions_agree
        )


@dataclass
class Selection:
    """The search over effects of all joints on one observation."""

    observation: Observation
    weights: Array
    candidates: Sequence[Candidate]
    model_columns: Index
    ratio_columns: Index
    added: list[tuple[Candidate, int]] = field(default_factory=list)

    def __post_init__(self) -> None:
        observation = self.observation
        self.motion = FoldedProducts(observation, self.weights, folds_of_motion(observation, FOLDS))
        sessions = folds_of_sessions(observation)
        self.sessions = FoldedProducts(observation, self.weights, sessions) if sessions.max() > 0 else None

    def base(self, declared: bool = False, without: Candidate | None = None) -> Index:
        """Columns of the present model; `declared` takes the payloads as declared."""
        parts = [self.model_columns]
        treats_load = any(c.name in ("payload-mass", "drive-gain") for c, _ in self.added if c is not without)
        if not declared and not treats_load:
            parts.append(self.ratio_columns)
        parts += [c.columns(self.observation, v) for c, v in self.added if c is not without]
        return np.unique(np.concatenate(parts))

    def open(self, joint: int) -> list[Candidate]:
        """Candidates of a joint that are not yet added."""
        present = {candidate.term.key for candidate, _ in self.added}
        return [c for c in self.candidates if c.judged == joint and c.term.key not in present]

    def findings(self, joint: int) -> list[Finding]:
        """All open candidates of a joint beside the present model, the best first."""
        found: list[Finding] = []
        for declared in (False, True):
            listed = [c for c in self.open(joint) if (c.name in DECLARED_LOAD) == declared]
            if listed:
                found += self._judge(joint, self.base(declared), listed)
        return self._ranked(found)

    def _judge(self, joint: int, base: Index, listed: Sequence[Candidate]) -> list[Finding]:
        empty = Trial((base[:0],))
        trials = [candidate.trial(self.observation) for candidate in listed]
        before, *after = self.motion.evaluate(joint, base, [empty, *trials])
        elsewhere = [None] * (len(listed) + 1)
        if self.sessions is not None:
            elsewhere = self.sessions.evaluate(joint, base, [empty, *trials])
        measured = self.motion.measured(joint)
        found = []
        for index, (candidate, fared) in enumerate(zip(listed, after, strict=True)):
            p_value = 1.0
            if fared.total < before.total:
                extra = np.setdiff1d(candidate.columns(self.observation, fared.variant), base)
                p_value = group_p_value(self.observation, joint, base, extra)
                p_value = min(1.0, p_value * candidate.searched * len(self.candidates))
            agree = True
            reference, other = elsewhere[0], elsewhere[index + 1]
            if reference is not None and other is not None and candidate.term.effect.rows != "robot":
                agree = other.total < reference.total * (1 + 1e-3)
            found.append(
                Finding(
                    candidate,
                    fared.variant,
                    before,
                    fared,
                    measured,
                    p_value,
                    candidate.complexity(self.observation, fared.variant),
                    agree,
                )
            )
        return found

    def _ranked(self, found: list[Finding]) -> list[Finding]:
        """By gain; a simpler one that is nearly as good goes before a more complex one."""
        rest = sorted(found, key=lambda finding: finding.gain, reverse=True)
        ranked: list[Finding] = []
        while rest:
            best = rest[0]
            near = [f for f in rest if best.gain > 0 and f.gain >= AS_GOOD * best.gain]
            justified = [f for f in near if f.justified] or near or [best]
            chosen = min(justified, key=lambda f: (f.complexity, -f.gain))
            ranked.append(chosen)
            rest.remove(chosen)
        return ranked

    def rivals(self, finding: Finding, found: Sequence[Finding]) -> tuple[str, ...]:
        """Effects that explain the data alike: nearly the gain, and the folds do not decide between them."""
        named = []
        for other in found:
            if other is finding or other.gain < RIVAL_GAIN * finding.gain or finding.gain <= 0:
                continue
            difference = other.after.fold - finding.after.fold
            spread = float(np.std(difference, ddof=1)) / np.sqrt(len(difference))
            if abs(float(difference.mean())) < 2.0 * spread or other.gain > AS_GOOD * finding.gain:
                named.append(other.candidate.name)
        return tuple(named)

    def run(self, joints: Sequence[int]) -> None:
        """Add what is justified, the strongest first, until nothing is; re-judge after each addition."""
        while True:
            best = self._strongest(joints)
            if best is None:
                break
            for candidate, variant in best:
                self.added.append((candidate, variant))
            self.drop_superfluous()

    def _strongest(self, joints: Sequence[int]) -> list[tuple[Candidate, int]] | None:
        """The justified addition with the largest drop over all joints: one effect, or a pair."""
        choices: list[tuple[float, list[tuple[Candidate, int]]]] = []
        for joint in joints:
            if sum(c.judged == joint for c, _ in self.added) >= MOST_ADDED:
                continue
            found = self.findings(joint)
            single = next((f for f in found if f.justified), None)
            if single is not None:
                choices.append((single.drop, [(single.candidate, single.variant)]))
            else:
                pair = self._pair(joint, found)
                if pair is not None:
                    choices.append(pair)
        return max(choices, key=lambda choice: choice[0])[1] if choices else None

    def _pair(self, joint: int, found: Sequence[Finding]) -> tuple[float, list[tuple[Candidate, int]]] | None:
        """Two effects that only help together."""
        listed = [f for f in found if f.candidate.name not in DECLARED_LOAD][:10]
        if len(listed) < 2:
            return None
        base = self.base()
        pairs = list(combinations(listed, 2))
        trials = []
        for one, other in pairs:
            first, second = one.candidate.trial(self.observation), other.candidate.trial(self.observation)
            trials.append(
                Trial(tuple(np.concatenate(both) for both in product(first.variants, second.variants)))
                if len(first.variants) * len(second.variants) <= 16
                else Trial((np.concatenate([first.variants[one.variant], second.variants[other.variant]]),))
            )
        before, *after = self.motion.evaluate(joint, base, [Trial((base[:0],)), *trials])
        best: tuple[float, list[tuple[Candidate, int]]] | None = None
        for (one, other), trial, fared in zip(pairs, trials, after, strict=True):
            drop = 1 - float(np.sqrt(max(fared.total, 0) / max(before.total, 1e-300)))
            if drop < 2 * LEAST_DROP or drop < 1.5 * max(one.drop, other.drop):
                continue
            if np.mean(fared.fold < before.fold) < 0.7:
                continue
            extra = np.setdiff1d(trial.variants[fared.variant], base)
            p_value = group_p_value(self.observation, joint, base, extra)
            tried = len(self.candidates) ** 2 * one.candidate.searched * other.candidate.searched
            if p_value * tried < SIGNIFICANCE and (best is None or drop > best[0]):
                single = len(trial.variants) > 1
                count = len(other.candidate.constants)
                chosen = divmod(fared.variant, count) if single else (one.variant, other.variant)
                best = drop, [(one.candidate, chosen[0]), (other.candidate, chosen[1])]
        return best

    def drop_superfluous(self) -> None:
        """Take out what an addition made superfluous."""
        for candidate, variant in list(self.added[:-1]):
            worth = self.worth(
                candidate.judged, self.base(without=candidate), candidate.columns(self.observation, variant)
            )
            if worth < SUPERFLUOUS and candidate.name not in ("payload-mass", "drive-gain"):
                self.added.remove((candidate, variant))

    def worth(self, joint: int, base: Index, columns: Index) -> float:
        """Part of the held-out error of a joint that some columns take away."""
        before, after = self.motion.evaluate(joint, base, [Trial((base[:0],)), Trial((columns,))])
        return float(np.sqrt(max(before.total, 0) / max(after.total, 1e-300)) - 1)
