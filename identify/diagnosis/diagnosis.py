"""`diagnose`: where a model fails and which physical effect is missing."""

from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from identify.diagnosis.caution import caution, load_siblings
from identify.diagnosis.elsewhere import fails_elsewhere
from identify.diagnosis.look import Look
from identify.diagnosis.sampling_hold import made_by_recording
from identify.diagnosis.selection import SUPERFLUOUS, Finding
from identify.diagnosis.structure import Structure, bounded, leftover_structure
from identify.diagnosis.verdict import (
    MOST_OF_IT,
    acts_like,
    imitated,
    part_of_free_function,
    verdict,
)
from identify.diagnosis.where import where_it_fails
from identify.effects.model import Model, Term
from identify.estimation.fitted_model import FittedModel
from identify.estimation.fitting import Progress, fit_model
from identify.estimation.prediction import Prediction, mean_error, predict
from identify.estimation.record import Record
from identify.estimation.requested_model import known_effects, open_record, requested_model
from identify.estimation.small_algebra import single_threaded
from identify.recording import Experiment
from identify.results import diagnosis as documents
from identify.results.diagnosis import DiagnosisDocument, NotApplicable, Verdict, Where
from identify.results.document import Json
from identify.validation.noise_floor import noise_floors

Array = NDArray[np.float64]

WORTH_OF_ALL = 0.002
"""Part of the joint's first squared error (held out) that an effect must take away. After a large effect is added, small
remains of its approximation stand out of the noise; they are significant and no operator's business."""
MOST_LOOKS = 7
"""Looks at a record; a joint that asks for more effects is not understood."""
SIBLING_GAIN = 0.5
"""Part of an effect's gain with which its twin that depends on the load (or does not) stays a rival where no load changes:
the folds see the same few loads again and cannot decide between the two."""


@dataclass(frozen=True)
class JointDiagnosis:
    """What is said of one joint.

    verdict   : missing, adequate or unexplained
    missing   : effects that are justified, the strongest first
    evidence  : how each of them fared when it was added, beside the model with those before it
    findings  : every candidate beside the model, the best first
    rivals    : for an effect those that explain the data alike, judged in the look that found it
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
    noise_floor: float | None
    superfluous: tuple[str, ...]
    cautions: dict[str, str] = field(default_factory=dict)

    def document(self) -> documents.JointDiagnosis:
        """Its part of the document."""
        return documents.JointDiagnosis(
            joint=self.joint,
            verdict=self.verdict,
            missing=tuple(term.effect.name for term in self.missing),
            candidates=self._candidates(self.findings),
            evidence=self._candidates(self.evidence),
            where=self.where,
            noise_floor=self.noise_floor,
            structure=tuple(
                documents.LeftoverStructure(
                    variables=each.variables, share=each.share, deviation=each.deviation, found=each.found
                )
                for each in self.structure
            ),
            superfluous=self.superfluous,
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
            explanation=effect.explanation,
            equation=effect.equation,
            variable=effect.variable,
            constants=finding.candidate.constants[finding.variant],
        )


@dataclass(frozen=True)
class Diagnosis:
    """The result of `diagnose`.

    fitted : the model that was diagnosed
    better : the same with the missing effects
    """

    experiment: Experiment
    model: str
    fitted: FittedModel
    better: FittedModel
    joints: tuple[JointDiagnosis, ...]
    added: tuple[Term, ...] = ()
    """the missing effects of all joints, in the order in which they were found, the strongest first"""
    left_out: tuple[NotApplicable, ...] = ()
    least: tuple[float, ...] = ()
    """for every joint the drop of the squared held-out error that an effect had to bring"""

    def document(self) -> DiagnosisDocument:
        """The contract's `diagnose --json`, section 3."""
        floors = [joint.noise_floor for joint in self.joints]
        return DiagnosisDocument(
            experiment=self.experiment.name,
            model=self.model,
            relative_error=self.fitted.fit.relative_error,
            relative_error_with_missing=self.better.fit.relative_error,
            noise_floor=overall_floor(floors, self.fitted.fit.norm),
            joints=tuple(joint.document() for joint in self.joints),
            not_applicable=self.left_out,
        )

    def to_json(self) -> Json:
        """The document as plain values."""
        return self.document().to_json()


def overall_floor(floors: Sequence[float | None], norm: Array) -> float | None:
    """Noise floor of all joints together, each weighted by its torque; None where one is not known."""
    known = [floor for floor in floors if floor is not None]
    if len(known) < len(floors) or not known:
        return None
    return float(np.linalg.norm(np.array(known) * norm) / np.linalg.norm(norm))


def diagnose(
    experiment: Experiment, model: str = "usual", add: Sequence[str] = (), progress: Progress | None = None
) -> Diagnosis:
    """Say where a model fails and which physical effect is missing.

    Raises InputError: the experiment, the model or an effect is wrong.
    """
    record = open_record(experiment)
    return diagnose_record(record, model, requested_model(record, model, add), progress)


@single_threaded
def diagnose_record(
    record: Record,
    name: str,
    model: Model,
    progress: Progress | None = None,
    without: frozenset[tuple[str, int]] = frozenset(),
    least: Sequence[float] | None = None,
) -> Diagnosis:
    """`diagnose` on an open record.

    without : effects (name, joint) that are not to be added
    least   : for every joint the drop of the squared held-out error that an effect must bring; found from this
              model's own error if not given

    Look at every candidate beside the model, add the strongest, fit again, take out what became superfluous, and
    look again: the load that candidates depend on, and what others hide, are then seen better.
    """
    told = progress or (lambda fraction, words: None)
    told(0.0, "fitting the model")
    fitted = present = fit_model(record, model)
    added: list[tuple[Term, int]] = []
    refused = set(without)
    evidence: dict[tuple[str, int], Finding] = {}
    doubts: dict[tuple[str, int], tuple[str, ...]] = {}
    look = first = Look.at(present)
    found = [look.selection.findings(joint) for joint in range(record.joints)]
    if least is None:
        least = [WORTH_OF_ALL * max((one.before.total for one in own), default=0.0) for own in found]
    for index in range(MOST_LOOKS):
        told(0.1 + 0.8 * index / MOST_LOOKS, "judging every candidate on motion that the fit did not see")
        look = Look.at(present) if index else first
        weak = [term for term, _ in added if look.worth(term) < SUPERFLUOUS]
        if weak:
            added = [(term, joint) for term, joint in added if term not in weak]
            refused |= {term.key for term in weak}
            present = _fit_with(record, fitted, added)
            look = Look.at(present)
        listed = [look.selection.findings(joint) for joint in range(record.joints)] if index else found
        open_ = [[f for f in own if f.candidate.term.key not in refused] for own in listed]
        chosen = look.selection.additions(open_, least) if index < MOST_LOOKS - 1 else []
        if not chosen:
            exchanged = _exchanged(look, added, refused, doubts) if index < MOST_LOOKS - 1 else None
            if exchanged is None:
                break
            added = exchanged
        for candidate, variant in chosen:
            own = listed[candidate.judged]
            doubts[candidate.key] = _rivals(look, _finding(own, candidate.name), own)
            added.append((candidate.term.chosen(candidate.constants[variant]), candidate.judged))
            evidence.update({f.candidate.key: f for own in open_ for f in own if f.candidate is candidate})
        present = _fit_with(record, fitted, added)
        added = _settled(present, added)
    held = {term.key: words for term, _ in added if (words := made_by_recording(present, term))}
    added.sort(key=lambda row: row[0].key in held)
    floors = noise_floors(record)
    checked = [predict(present, entry) for entry in record.entries("validation")]
    unseen = [[parts[joint] for parts in checked] for joint in range(record.joints)]
    joints = tuple(
        _conclude(
            first,
            look,
            joint,
            found[joint],
            tuple(t for t, judged in added if judged == joint),
            held,
            evidence,
            floors[joint],
            unseen[joint],
            {name: named for (name, judged), named in doubts.items() if judged == joint},
        )
        for joint in range(record.joints)
    )
    told(1.0, "done")
    named = {(term.effect.name, joint.joint) for joint in joints for term in joint.missing}
    told_missing = tuple(t for t, judged in added if (t.effect.name, record.joint_names[judged]) in named)
    return Diagnosis(
        record.experiment, name, fitted, present, joints, told_missing, tuple(first.left_out), tuple(least)
    )


def _fit_with(record: Record, fitted: FittedModel, added: Sequence[tuple[Term, int]]) -> FittedModel:
    """The diagnosed model with the added terms, their constants searched around what was found."""
    return fit_model(record, fitted.model.with_terms(term for term, _ in added), refine=True)


def _exchanged(
    look: Look,
    added: Sequence[tuple[Term, int]],
    refused: set[tuple[str, int]],
    doubts: dict[tuple[str, int], tuple[str, ...]],
) -> list[tuple[Term, int]] | None:
    """The added terms with one that imitated another effect exchanged for it; None where there is none.

    doubts : for an added effect those that explained the data alike when it was added; what is exchanged for one that
             only a change of load would tell from it stays its rival

    What was exchanged does not come back.
    """
    for place, (term, judged) in enumerate(added):
        named = doubts.get((term.effect.name, judged), ())
        better = look.replacement(term, named) if len(added) > 1 else None
        if better is not None and better[0].key not in refused:
            refused.add(term.key)
            known, summary = (
                known_effects(look.fitted.record.experiment),
                look.fitted.record.summaries[judged],
            )
            siblings = load_siblings(better[0].effect, known, summary)
            doubts[better[0].effect.name, better[1]] = tuple({term.effect.name} & set(siblings))
            return [*added[:place], better, *added[place + 1 :]]
    return None


def _settled(present: FittedModel, added: Sequence[tuple[Term, int]]) -> list[tuple[Term, int]]:
    """The added terms with the constants of the present fit."""
    constants = {term.key: term for term in present.model.terms}
    return [(constants[term.key], judged) for term, judged in added]


def _finding(found: Sequence[Finding], name: str) -> Finding:
    return next(finding for finding in found if finding.candidate.name == name)


def _rivals(look: Look, finding: Finding, found: Sequence[Finding]) -> tuple[str, ...]:
    """Effects that explain the data as well as one that was found, or that only a change of load would tell from it."""
    candidate = finding.candidate
    record = look.fitted.record
    known = known_effects(record.experiment)
    siblings = load_siblings(candidate.term.effect, known, record.summaries[candidate.judged])
    named = list(look.selection.rivals(finding, found)) if finding.justified else []
    for other in found:
        name = other.candidate.name
        if name in siblings and name not in named and other.gain >= SIBLING_GAIN * finding.gain > 0:
            named.append(name)
    return tuple(named)


def _both_ways(
    found: Sequence[Finding],
    missing: Sequence[str],
    strongest: tuple[str, ...],
    doubts: dict[str, tuple[str, ...]],
) -> dict[str, tuple[str, ...]]:
    """Rivals by effect, each named at the other: those of what is missing, and of the strongest candidate.

    Two effects that are both missing are no rivals: each helps beside the other.
    """
    pairs = {(name, rival) for name in missing for rival in doubts.get(name, ())}
    if found:
        pairs |= {(found[0].candidate.name, rival) for rival in strongest}
    pairs = {pair for pair in pairs if not set(pair) <= set(missing)}
    order = [finding.candidate.name for finding in found]
    return {
        name: tuple(rival for rival in order if (name, rival) in pairs or (rival, name) in pairs)
        for name in order
        if any(name in pair for pair in pairs)
    }


def _conclude(
    look: Look,
    final: Look,
    joint: int,
    findings: Sequence[Finding],
    missing: tuple[Term, ...],
    held: dict[tuple[str, int], str],
    evidence: dict[tuple[str, int], Finding],
    floor: float | None,
    unseen: Sequence[Prediction],
    doubts: dict[str, tuple[str, ...]],
) -> JointDiagnosis:
    sampling = tuple(term for term in missing if term.key in held)
    missing = tuple(term for term in missing if term.key not in held)
    before, after = look.predictions[joint], final.predictions[joint]
    structure = tuple(leftover_structure(after))
    said = verdict(mean_error(before), mean_error(bounded(after)), floor, structure, bool(missing))
    variable, free = look.best_free_function(joint)
    elsewhere = unseen if said == "adequate" and fails_elsewhere(after, unseen) else []
    said = "unexplained" if elsewhere else said
    where = where_it_fails([*before, *elsewhere])
    of_one_variable = all(term.effect.variable == variable for term in missing)
    part = _part_of_free_function(missing, evidence, joint, free)
    error = final.selection.held_out_error(joint)
    if imitated(error, free, len(missing), of_one_variable) and not acts_like(part, error, free):
        keeps_its_name = part > MOST_OF_IT and missing[0].effect.variable == variable
        said, missing = "unexplained", missing[:1] if keeps_its_name else ()
        where = tuple(sorted(where, key=lambda row: row.variable != variable))
    if missing:
        missing = (*missing, *sampling)
    names = [term.effect.name for term in missing]
    strongest = _rivals(look, findings[0], findings) if findings and findings[0].justified else ()
    record = look.fitted.record
    known, summary = known_effects(record.experiment), record.summaries[joint]
    effects = [finding.candidate.term.effect for finding in findings]
    cautions = {effect.name: caution(effect, known, summary) for effect in effects}
    cautions.update({term.effect.name: held[term.key] for term in sampling})
    return JointDiagnosis(
        joint=record.joint_names[joint],
        verdict=said,
        missing=missing,
        evidence=tuple(
            evidence[term.effect.name, joint] for term in missing if (term.effect.name, joint) in evidence
        ),
        findings=tuple(_missing_first(findings, names)),
        rivals=_both_ways(findings, names, strongest, doubts),
        cautions={name: words for name, words in cautions.items() if words},
        structure=structure,
        where=where,
        noise_floor=floor,
        superfluous=look.superfluous(joint),
    )


def _part_of_free_function(
    missing: Sequence[Term],
    evidence: dict[tuple[str, int], Finding],
    joint: int,
    free: float,
) -> float:
    """How much of what the best free function takes away the strongest missing effect does."""
    first = evidence.get((missing[0].effect.name, joint)) if missing else None
    if first is None:
        return 0.0
    return part_of_free_function(first.relative(first.before.total), first.relative(first.after.total), free)


def _missing_first(findings: Sequence[Finding], missing: Sequence[str]) -> list[Finding]:
    """Findings with the strongest missing effect in front, so that rank 1 is what would be added first."""
    if not missing:
        return list(findings)
    front = [finding for finding in findings if finding.candidate.name == missing[0]]
    return front + [finding for finding in findings if finding.candidate.name != missing[0]]
