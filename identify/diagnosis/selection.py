"""Which effects are justified: forward, in pairs, and backward, by the error on motion that the fit did not see."""

from collections.abc import Collection, Sequence
from copy import copy
from dataclasses import dataclass, replace
from functools import partial

import numpy as np
from numpy.typing import NDArray

from identify.diagnosis.candidates import Candidate
from identify.diagnosis.closed_loop import Asked
from identify.diagnosis.deciding_constants import (
    DROP_PER_PARAMETER,
    FOLDS,
    MOST,
    NEARLY_ALL,
    SIGNIFICANCE,
)
from identify.diagnosis.evidence import GroupEvidence, group_evidence
from identify.diagnosis.finding import Finding, gained
from identify.diagnosis.held_out import FoldedProducts, HeldOut, Trial, folds_of_motion, folds_of_sessions
from identify.diagnosis.pairs import Addition, Choice, Pairs
from identify.diagnosis.probability import probability_left
from identify.effects.effect import DeclaredLoad
from identify.estimation import forked
from identify.estimation.observation import Observation

Array = NDArray[np.float64]
Index = NDArray[np.intp]
ROUNDING = 1e-9
"""Of the squared error: less is no gain but rounding, of columns whose values cannot be other than zero."""


@dataclass
class Selection:
    """The search over effects of all joints on one observation.

    model_columns : columns of the present model
    ratio_columns : those of the payload ratio that is estimated beside it (eq. 35); empty where it is not
    loop          : what instruments that disturbances do not reach say of candidates
    only_justified : whether nobody asks for the evidence of candidates that are not justified whatever it is
    turning       : of every joint columns of what is not known of its reversals, beside which candidates are judged
    """

    observation: Observation
    weights: Array
    candidates: Sequence[Candidate]
    model_columns: Index
    ratio_columns: Index
    loop: Asked
    only_justified: bool = False
    turning: Sequence[Index] = ()

    def __post_init__(self) -> None:
        observation = self.observation
        # What is left out stays with the weight of one observation (Kass, Wasserman 1995): a stretch of motion of one sample, a
        # session of one block of time. The rest may tell nothing of a parameter (the sign of a load that turns round in one
        # stretch; with one load, what a change of load would tell), and a guess at it is no prediction.
        folds, samples = folds_of_motion(observation, FOLDS), observation.samples.mean()
        self.motion = FoldedProducts(
            observation, self.weights, folds, (int(folds.max()) + 1) / max(samples, 1), self.base()
        )
        sessions = folds_of_sessions(observation)
        known = (int(sessions.max()) + 1) / len(sessions)
        self.sessions = (
            FoldedProducts(observation, self.weights, sessions, known) if sessions.max() > 0 else None
        )

    def beside(self, columns: Index, candidates: Sequence[Candidate]) -> "Selection":
        """The search over some candidates beside other columns of the same observation, whose products are there."""
        other = copy(self)
        other.model_columns, other.candidates = columns, candidates
        return other

    def on(self, observation: Observation) -> "Selection":
        """The same model on another observation that begins with its columns, without candidates."""
        return replace(self, observation=observation, candidates=(), turning=())

    def base(self, declared: bool = False) -> Index:
        """Columns of the present model; `declared` takes the payloads as declared."""
        return self.model_columns if declared else np.union1d(self.model_columns, self.ratio_columns)

    def _beside_turning(self, joint: int, declared: bool = False) -> Index:
        """`base` and what is not known of a joint's reversals, which no candidate of the joint is to explain."""
        return np.union1d(self.base(declared), [*self.turning[joint]] if self.turning else []).astype(np.intp)

    def search(
        self,
        refused: Collection[tuple[str, int]],
        least: Sequence[float],
        known: Sequence[list[Finding]] | None = None,
    ) -> tuple[list[list[Finding]], list[Addition]]:
        """Of every joint all candidates beside the present model, the best first; and what to add now: each joint's
        strongest justified effect, or a pair that only helps together.

        refused : effects (name, joint) that are not to be added
        least   : for every joint the gain that an effect must have
        known   : what a search on these observations found, which what is refused does not change

        Joints whose strongest is much weaker than the strongest of all wait: a fault of one joint shows in
        others through the inertial parameters that they share. Several may ask for one effect at once: of the whole robot,
        or of a motor that two of them share.
        """

        def of_joint(joint: int) -> tuple[list[Finding], Choice | None, list[Choice]]:
            findings = self.findings(joint) if known is None else known[joint]
            open_ = [f for f in findings if f.candidate.term.key not in refused]
            single = next((f for f in open_ if f.gain >= least[joint] and f.justified), None)
            if single is not None:
                return findings, (single.drop, [(single.candidate, single.variant)]), []
            return findings, None, self._pairs(joint).strong(open_, least[joint])

        by_joint = forked.each(of_joint, range(len(self.observation.joint_columns)), known=self.candidates)
        choices = [single for _, single, _ in by_joint]
        # the evidence is the dear part of a pair, and a pair that is weak beside what another joint adds waits
        drop = MOST * max((single[0] for single in choices if single is not None), default=0.0)
        strong = [[pair for pair in pairs if pair[0] >= drop] for _, _, pairs in by_joint]
        asked = [joint for joint, pairs in enumerate(strong) if pairs]

        def strongest_pair(joint: int) -> Choice | None:
            holds = self._pairs(joint).holds
            return next((p for p in strong[joint] if holds(p[1]) and not self._refuted(joint, p[1])), None)

        for joint, pair in zip(asked, forked.each(strongest_pair, asked, known=self.candidates), strict=True):
            choices[joint] = pair
        listed = sorted(
            (each for each in choices if each is not None), key=lambda each: each[0], reverse=True
        )
        strongest = listed[0][0] if listed else 0.0
        additions = [each for drop, added in listed if drop >= MOST * strongest for each in added]
        return [findings for findings, _, _ in by_joint], additions

    def findings(self, joint: int) -> list[Finding]:
        """All candidates of a joint beside the present model, the best first."""
        candidates = [candidate for candidate in self.candidates if candidate.judged == joint]
        base, as_declared = (self._beside_turning(joint, declared) for declared in (False, True))
        ordinary = [c for c in candidates if c.beside_ratio]
        free = self.motion.alone(joint, base)
        declared = self.motion.alone(joint, as_declared)
        better = min(free, declared, key=lambda fared: fared.total)
        load_friction = [c for c in candidates if c.declared_load is DeclaredLoad.TRUSTED]
        loads = [c for c in candidates if c.declared_load is DeclaredLoad.QUESTIONED]
        if len(self.ratio_columns):
            findings = self._judge(joint, base, free, ordinary)
            friction = self._judge(joint, as_declared, better, load_friction)
            of_loads = self._judge(joint, as_declared, declared, loads)
        else:
            judged = self._judge(joint, base, free, [*ordinary, *load_friction, *loads])
            ends = len(ordinary), len(ordinary) + len(load_friction)
            findings, friction, of_loads = judged[: ends[0]], judged[ends[0] : ends[1]], judged[ends[1] :]
        reference = free
        if any(finding.justified for finding in of_loads):
            reference = declared
            trials = [finding.candidate.trial(self.observation) for finding in findings]
            without_ratio = self.motion.evaluate(joint, as_declared, trials)
            findings = [
                replace(finding, comparable_gain=declared.total - fared.total)
                for finding, fared in zip(findings, without_ratio, strict=True)
            ]
        findings += [
            replace(finding, comparable_gain=reference.total - finding.after.total)
            for finding in (*friction, *of_loads)
        ]
        return self._ranked(findings)

    def _judge(
        self,
        joint: int,
        base: Index,
        before: HeldOut,
        listed: Sequence[Candidate],
        instruments: bool = True,
    ) -> list[Finding]:
        """How some candidates fare beside some columns; instruments are asked once, when an effect is to be added."""
        if not listed:
            return []
        trials = [candidate.trial(self.observation) for candidate in listed]
        after = self.motion.evaluate(joint, base, trials)
        agree = self._sessions_agree(joint, np.setdiff1d(base, self.ratio_columns), listed, trials)
        measured = self.motion.measured(joint)
        findings = []
        for candidate, fared, agrees in zip(listed, after, agree, strict=True):
            finding = Finding(
                candidate,
                fared.variant,
                before,
                fared,
                before.total - fared.total,
                measured,
                0.0,
                candidate.complexity(self.observation, fared.variant),
                agrees,
            )
            p_value, estimated = 1.0, None
            gains = fared.total < before.total * (1 - ROUNDING)
            if finding.justified if self.only_justified else gains:
                p_value, estimated = self.possible_evidence(joint, base, candidate, fared.variant)
                p_value = min(1.0, p_value * candidate.searched * self.tried(joint))
            findings.append(replace(finding, p_value=p_value, estimated=estimated))
        return self._seen_with_instruments(joint, findings) if instruments else findings

    def beside_the_others(self, added: Sequence[Candidate], least: Sequence[float]) -> list[Finding]:
        """Terms of the model that a search added, each beside all the rest of the model; the ones that are no longer
        justified so taken out, the weakest first. What went beside another that went after it is asked again beside those
        that stay, once.

        added : candidates whose columns are those of the model's slots
        least : for every joint the gain that an effect must have
        """
        gone: list[Candidate] = []
        returned: list[Candidate] = []
        while True:
            kept = [each for each in added if not _one_of(each, gone)]
            findings = forked.each(partial(self._beside_the_rest, gone=tuple(gone)), kept, known=kept)
            weak = [f for f in findings if not _holds(f, least)]
            if weak:
                gone.append(min(weak, key=lambda finding: finding.drop).candidate)
                continue
            asked = [each for each in gone[:-1] if not _one_of(each, returned)]
            wronged = [f for f in (self._beside_the_rest(each, gone) for each in asked) if _holds(f, least)]
            if not wronged:
                return findings
            returned.append(max(wronged, key=lambda finding: finding.drop).candidate)
            gone = [each for each in gone if each is not returned[-1]]

    def _beside_the_rest(self, candidate: Candidate, gone: Sequence[Candidate]) -> Finding:
        """A term of the model beside the rest of it, without those that are gone."""
        without = [each.columns(self.observation, 0) for each in (*gone, candidate)]
        base = np.setdiff1d(self.base(declared=not candidate.beside_ratio), np.concatenate(without))
        before = self.motion.alone(candidate.judged, base)
        (finding,) = self._judge(candidate.judged, base, before, [candidate], instruments=False)
        return finding

    def reference(self, joint: int, columns: Index) -> float:
        """Held-out squared error of a joint with some columns of effects beside the rigid robot."""
        base = np.union1d(np.arange(self.observation.base), columns)
        return self.motion.alone(joint, base).total

    def possible_evidence(
        self, joint: int, base: Index, candidate: Candidate, variant: int
    ) -> tuple[float, GroupEvidence | None]:
        """Evidence of a candidate for values that it can have, and its estimates; what wants to be outside explains
        nothing, and there are no estimates where all of it does."""
        extra = np.setdiff1d(candidate.columns(self.observation, variant), base)
        inside = np.ones(len(extra), bool)
        while inside.any():
            evidence = group_evidence(self.observation, joint, base, extra[inside])
            if len(evidence.estimates) != int(inside.sum()):
                # not all of its columns are on the joint's rows: nothing is known of what these can be
                return evidence.p_value, evidence if inside.all() else None
            estimates, deviations = np.zeros(len(extra)), np.zeros(len(extra))
            estimates[inside], deviations[inside] = evidence.estimates, evidence.deviations
            outside = candidate.outside(estimates, variant) & inside
            if not outside.any():
                return evidence.p_value, GroupEvidence(evidence.p_value, estimates, deviations)
            inside &= ~outside
        return 1.0, None

    def _seen_with_instruments(self, joint: int, findings: list[Finding]) -> list[Finding]:
        """The findings with what instruments say of those made of derivatives that the evidence would call missing."""
        asked = [f for f in findings if f.candidate.from_derivatives and f.justified]
        if not asked:
            return findings
        answers = self.loop(joint, [(finding.candidate, finding.variant) for finding in asked])
        known = {finding.candidate.name: evidence for finding, evidence in zip(asked, answers, strict=True)}
        return [replace(finding, loop=known.get(finding.candidate.name)) for finding in findings]

    def _refuted(self, joint: int, listed: Sequence[Addition]) -> bool:
        """Whether instruments see nothing of one of some candidates."""
        asked = [(c, variant) for c, variant in listed if c.from_derivatives]
        return bool(asked) and any(e.p_value >= SIGNIFICANCE for e in self.loop(joint, asked))

    def _sessions_agree(
        self, joint: int, base: Index, listed: Sequence[Candidate], trials: Sequence[Trial]
    ) -> list[bool]:
        """Whether each candidate does no harm on whole sessions left out: does not raise the squared error there.

        Payloads are taken as declared: a payload's ratio cannot be known from the other sessions. For the same
        reason effects that have parameters for each payload or session are not asked.
        """
        if self.sessions is None:
            return [True] * len(listed)
        reference = self.sessions.alone(joint, base)
        others = self.sessions.evaluate(joint, base, trials)
        return [
            candidate.declared_load is DeclaredLoad.QUESTIONED or other.total <= reference.total
            for candidate, other in zip(listed, others, strict=True)
        ]

    def _ranked(self, findings: list[Finding]) -> list[Finding]:
        """By comparable gain; a simpler one that is nearly as good goes before a more complex one. Those that do nothing keep
        the catalogue's order, which rounding would decide otherwise."""

        def gain(finding: Finding) -> float:
            size = abs(finding.comparable_gain)
            return finding.comparable_gain if size > ROUNDING * finding.before.total else 0.0

        rest = sorted(findings, key=gain, reverse=True)
        ranked: list[Finding] = []
        while rest:
            best = rest[0]
            near = [best, *(f for f in rest[1:] if self._as_good(f, best))]
            near = [f for f in near if f.justified] or near
            chosen = min(near, key=lambda f: (f.complexity, -f.comparable_gain))
            ranked.append(chosen)
            rest.remove(chosen)
        return ranked

    def _as_good(self, finding: Finding, best: Finding) -> bool:
        """Whether the lead of another over a finding is too small to matter, or not decided."""
        if best.comparable_gain <= 0 or finding.comparable_gain < NEARLY_ALL * best.comparable_gain:
            return False
        lead = best.comparable_gain - finding.comparable_gain
        bought = gained(DROP_PER_PARAMETER * max(best.complexity - finding.complexity, 0))
        return lead <= bought * best.before.total or not self._decided(best, finding)

    def _decided(self, finding: Finding, other: Finding) -> bool:
        """Whether a finding explains what another does not."""
        return self._beside(finding, other) < SIGNIFICANCE

    def _beside(self, finding: Finding, other: Finding) -> float:
        """Evidence of a finding's columns beside another's: a small p-value where the other is not the cause alone (encompassing;
        Davidson, MacKinnon 1981, Econometrica 49(3), for models of which none contains the other)."""
        base = self.base(declared=not (finding.candidate.beside_ratio and other.candidate.beside_ratio))
        base = np.union1d(base, other.candidate.columns(self.observation, other.variant))
        columns = finding.candidate.columns(self.observation, finding.variant)
        return self._p_value(finding.candidate.judged, base, columns)

    def rivals(self, finding: Finding, findings: Sequence[Finding]) -> tuple[str, ...]:
        """Effects that explain the data alike: nearly the gain, and what the finding explains beside them leaves them more than
        `SIGNIFICANCE` of the probability, which is larger than the p-value."""
        if finding.comparable_gain <= 0:
            return ()
        return tuple(
            other.candidate.name
            for other in findings
            if other is not finding
            and other.comparable_gain >= NEARLY_ALL * finding.comparable_gain
            and probability_left(self._beside(finding, other)) >= SIGNIFICANCE
        )

    def _pairs(self, joint: int) -> Pairs:
        return Pairs(self.observation, self.motion, joint, self._beside_turning(joint), self.tried(joint))

    def replacement(self, joint: int, columns: Index, complexity: int) -> Addition | None:
        """The candidate that does better on unseen motion in the place of some columns of the model: by what a parameter must
        bring where it has as many, by anything where it has fewer.

        Which of two effects was found first, beside fewer others, is no evidence for it.
        """
        better = []
        for beside_ratio in (True, False):
            listed = [c for c in self.candidates if c.judged == joint and c.beside_ratio == beside_ratio]
            listed = [c for c in listed if c.declared_load is not DeclaredLoad.QUESTIONED]
            base = np.setdiff1d(self.base(declared=not beside_ratio), columns)
            least = gained(DROP_PER_PARAMETER) * self.motion.alone(joint, base).total
            present, *others = self.motion.evaluate(
                joint, base, [Trial((columns,)), *(c.trial(self.observation) for c in listed)]
            )
            for candidate, other in zip(listed, others, strict=True):
                excess = candidate.complexity(self.observation, other.variant) - complexity
                if excess > 0 or present.total - other.total <= (0.0 if excess else least):
                    continue
                extra = np.setdiff1d(candidate.columns(self.observation, other.variant), base)
                estimates = group_evidence(self.observation, joint, base, extra).estimates
                if not candidate.outside(estimates, other.variant).any():
                    better.append((other.total / present.total, candidate, other.variant))
        for _, candidate, variant in sorted(better, key=lambda row: row[0]):
            if not self._refuted(joint, [(candidate, variant)]):
                return candidate, variant
        return None

    def decided_since(
        self, joint: int, columns: Index, complexity: int, rivals: Sequence[str]
    ) -> Addition | None:
        """The rival of a term of the model that explains what the term does not, and leaves it nothing to explain.

        columns, complexity : the term's. What one round left undecided may be decided when other effects are in the model; the
                              rival must lead by what a parameter must bring, or each that it has more.
        """
        listed = [c for c in self.candidates if c.judged == joint and c.name in rivals]
        if not listed:
            return None
        base = self.base(declared=not all(c.beside_ratio for c in listed))
        base = np.setdiff1d(base, columns)
        before = self.motion.alone(joint, base).total
        present, *others = self.motion.evaluate(
            joint, base, [Trial((columns,)), *(c.trial(self.observation) for c in listed)]
        )
        for candidate, other in sorted(zip(listed, others, strict=True), key=lambda row: row[1].total):
            rival = candidate.columns(self.observation, other.variant)
            more = max(candidate.complexity(self.observation, other.variant) - complexity, 1)
            if (
                present.total - other.total > gained(DROP_PER_PARAMETER * more) * before
                and self._p_value(joint, np.union1d(base, columns), rival) < SIGNIFICANCE
                and self._p_value(joint, np.union1d(base, rival), columns) > SIGNIFICANCE
                and not self._refuted(joint, [(candidate, other.variant)])
            ):
                return candidate, other.variant
        return None

    def _p_value(self, joint: int, base: Index, columns: Index) -> float:
        return group_evidence(self.observation, joint, base, np.setdiff1d(columns, base)).p_value

    def tried(self, joint: int) -> int:
        """Number of candidates of a joint, for the correction of the evidence."""
        return sum(candidate.judged == joint for candidate in self.candidates)

    def held_out_error(self, joint: int, extra: Index | None = None) -> float:
        """Relative held-out error of a joint with the present model, or with further columns."""
        base = self.base()
        fared = self.motion.alone(joint, base)
        if extra is not None:
            (fared,) = self.motion.evaluate(joint, base, [Trial((extra,))])
        return float(np.sqrt(max(fared.total, 0.0) / max(self.motion.measured(joint), 1e-300)))

    def explains(self, joint: int, columns: Index) -> bool:
        """Whether further columns lower a joint's error on unseen motion: many of them lose as much as a weak cause gains."""
        return self.held_out_error(joint, columns) < self.held_out_error(joint)

    def worth(self, joint: int, base: Index, columns: Index) -> float:
        """Part of the held-out error of a joint that some columns take away."""
        before = self.motion.alone(joint, base)
        after = self.motion.evaluate(joint, base, [Trial((columns,))])[0]
        return float(np.sqrt(max(before.total, 0) / max(after.total, 1e-300)) - 1)


def _one_of(candidate: Candidate, some: Sequence[Candidate]) -> bool:
    return any(candidate is each for each in some)


def _holds(finding: Finding, least: Sequence[float]) -> bool:
    return finding.justified and finding.gain >= least[finding.candidate.judged]
