"""What is said of one joint, and its part of the document."""

from collections.abc import Collection, Sequence
from dataclasses import dataclass, field, replace

import numpy as np

from identify.diagnosis.finding import Finding
from identify.diagnosis.probability import JointProbabilities
from identify.diagnosis.structure import Structure
from identify.effects.model import Term
from identify.results import diagnosis as documents
from identify.results.diagnosis import Learned, Verdict, Where
from identify.validation.noise_floor import NoiseFloor


@dataclass(frozen=True)
class JointDiagnosis:
    """What is said of one joint.

    verdict   : missing, adequate or unexplained
    missing   : effects that are justified, the strongest first
    evidence  : what each of them is worth beside all the others
    findings  : every candidate beside the model, the best first; what stands out only beside the missing ones, beside them
    rivals    : for an effect those that explain the data alike, judged in the round that found it
    doubted   : a variable over which a free function explains what missing effects of a fixed shape do not
    learned   : a description of what they do not explain; None where none is offered
    probable  : how probable each candidate is, and that nothing, or nothing known, is missing
    cautions  : for a candidate what these data cannot tell of it
    structure : what a predictor without any model still finds, after the missing effects are added
    """

    joint: str
    verdict: Verdict
    missing: tuple[Term, ...]
    evidence: tuple[Finding, ...]
    findings: tuple[Finding, ...]
    rivals: dict[str, tuple[str, ...]]
    structure: tuple[Structure, ...]
    where: tuple[Where, ...]
    noise_floor: NoiseFloor | None
    superfluous: tuple[str, ...]
    probable: JointProbabilities
    cautions: dict[str, str] = field(default_factory=dict)
    doubted: str | None = None
    learned: Learned | None = None
    beyond_description: bool = False
    """whether a description was looked for and none holds: nobody needs to look again"""

    @property
    def open(self) -> bool:
        """Whether a description is worth looking for: the verdict is `unexplained`, or `adequate` although a predictor finds
        more than noise leaves, if not in every stretch of the motion."""
        suspected = any(each.share > each.least for each in self.structure)
        return self.verdict == "unexplained" or (self.verdict == "adequate" and suspected)

    def described(self, learned: Learned, replaces: Collection[str]) -> "JointDiagnosis":
        """With a description, in the place of missing effects that explain nothing beside it: the cause is in no
        catalogue, and so is what they were probable for."""
        return replace(
            self,
            verdict="unexplained",
            missing=tuple(term for term in self.missing if term.effect.name not in replaces),
            evidence=tuple(each for each in self.evidence if each.candidate.name not in replaces),
            probable=self.probable.beyond_the_catalogue(replaces),
            learned=learned,
        )

    def document(self) -> documents.JointDiagnosis:
        """Its part of the document."""
        return documents.JointDiagnosis(
            joint=self.joint,
            verdict=self.verdict,
            missing=tuple(term.effect.name for term in self.missing),
            candidates=self._candidates(self.findings),
            evidence=self._candidates(self.evidence),
            where=self.where,
            noise_floor=None if self.noise_floor is None else self.noise_floor.value,
            noise_floor_interval=None
            if self.noise_floor is None
            else (self.noise_floor.low, self.noise_floor.high),
            structure=tuple(
                documents.LeftoverStructure(
                    variables=each.variables, share=each.share, deviation=each.deviation, found=each.found
                )
                for each in self.structure
            ),
            superfluous=self.superfluous,
            probability_adequate=self.probable.adequate,
            probability_unexplained=self.probable.unexplained,
            learned=self.learned,
        )

    def _candidates(self, findings: Sequence[Finding]) -> tuple[documents.Candidate, ...]:
        return tuple(self._candidate(finding, rank) for rank, finding in enumerate(findings, start=1))

    def _candidate(self, finding: Finding, rank: int) -> documents.Candidate:
        effect = finding.candidate.term.effect
        return documents.Candidate(
            effect=effect.name,
            rank=rank,
            relative_error_before=finding.relative(finding.before.trained),
            relative_error_after=finding.relative(finding.after.trained),
            heldout_error_before=finding.relative(finding.before.total),
            heldout_error_after=finding.relative(finding.after.total),
            p_value=finding.p_value,
            justified=finding.justified,
            indistinguishable_from=self.rivals.get(effect.name, ()),
            caution=self.cautions.get(effect.name),
            explanation=effect.explained(finding.candidate.summary),
            equation=effect.equation,
            variable=effect.variable,
            constants=finding.candidate.constants[finding.variant],
            probability=self.probable.effects.get(effect.name),
            estimates=_estimates(finding),
        )


def _estimates(finding: Finding) -> tuple[documents.Estimate, ...] | None:
    """A candidate's parameters beside the model; None where it lowers no error. A parameter of which the record says nothing
    has no value."""
    if finding.estimated is None:
        return None
    return tuple(
        documents.Estimate(
            name=name, value=None if np.isnan(deviation) else value, std_robust=deviation, unit=unit
        )
        for (name, unit), value, deviation in zip(
            finding.candidate.parameters(len(finding.estimated.estimates), finding.variant),
            (finding.estimated.estimates + finding.candidate.reported_offset(finding.variant)).tolist(),
            finding.estimated.deviations.tolist(),
            strict=True,
        )
    )
