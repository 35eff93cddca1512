"""`diagnose`: where a model fails and which physical effect is missing."""

from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import NDArray

from identify.diagnosis.look import Look
from identify.diagnosis.selection import SUPERFLUOUS, Finding
from identify.diagnosis.structure import Structure, leftover_structure
from identify.diagnosis.verdict import imitated, verdict
from identify.diagnosis.where import where_it_fails
from identify.effects.model import Model, Term
from identify.estimation.fitting import FittedModel, Progress, fit_model
from identify.estimation.identification import number, open_record, requested_model
from identify.estimation.prediction import Prediction, relative_error
from identify.estimation.record import Record
from identify.estimation.small_algebra import single_threaded
from identify.recording import Experiment
from identify.validation.noise_floor import noise_floors

Array = NDArray[np.float64]

MOST_LOOKS = 7
"""Looks at a record; a joint that asks for more effects is not understood."""


@dataclass(frozen=True)
class JointDiagnosis:
    """What is said of one joint.

    verdict   : missing, adequate or unexplained
    missing   : effects that are justified, the strongest first
    evidence  : how each of them fared when it was added, beside the model with those before it
    findings  : every candidate beside the model, the best first
    structure : what a predictor without any model still finds, after the missing effects are added
    """

    joint: str
    verdict: str
    missing: tuple[Term, ...]
    evidence: tuple[Finding, ...]
    findings: tuple[Finding, ...]
    rivals: dict[str, tuple[str, ...]]
    structure: tuple[Structure, ...]
    where: list[dict[str, object]]
    noise_floor: float | None
    superfluous: tuple[str, ...]

    def to_json(self) -> dict[str, Any]:
        """The contract's form."""
        return {
            "joint": self.joint,
            "verdict": self.verdict,
            "missing": [term.effect.name for term in self.missing],
            "candidates": [
                _candidate_json(finding, rank, self.rivals.get(finding.candidate.name, ()))
                for rank, finding in enumerate(self.findings, start=1)
            ],
            "evidence": [
                _candidate_json(finding, rank, self.rivals.get(finding.candidate.name, ()))
                for rank, finding in enumerate(self.evidence, start=1)
            ],
            "where": self.where,
            "noise_floor": number(self.noise_floor),
            "structure": [
                {"variables": list(s.variables), "share": number(s.share), "deviation": number(s.deviation)}
                for s in self.structure
            ],
            "superfluous": list(self.superfluous),
        }


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
    left_out: tuple[dict[str, str], ...] = field(default=())

    def to_json(self) -> dict[str, Any]:
        """The contract's `diagnose --json`, section 3."""
        floors = [joint.noise_floor for joint in self.joints]
        return {
            "experiment": self.experiment.name,
            "model": self.model,
            "relative_error": number(self.fitted.fit.relative_error),
            "relative_error_with_missing": number(self.better.fit.relative_error),
            "noise_floor": overall_floor(floors, self.fitted.fit.norm),
            "joints": [joint.to_json() for joint in self.joints],
            "not_applicable": list(self.left_out),
        }


def overall_floor(floors: Sequence[float | None], norm: Array) -> float | None:
    """Noise floor of all joints together, each weighted by its torque; None where one is not known."""
    known = [floor for floor in floors if floor is not None]
    if len(known) < len(floors) or not known:
        return None
    return number(float(np.linalg.norm(np.array(known) * norm) / np.linalg.norm(norm)))


def diagnose(
    experiment: Experiment, model: str = "usual", add: Sequence[str] = (), progress: Progress | None = None
) -> Diagnosis:
    """Say where a model fails and which physical effect is missing.

    :raises InputError: the experiment, the model or an effect is wrong.
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
) -> Diagnosis:
    """`diagnose` on an open record.

    without : effects (name, joint) that are not to be added

    Look at every candidate beside the model, add the strongest, fit again, take out what became superfluous, and
    look again: the load that candidates depend on, and what others hide, are then seen better.
    """
    told = progress or (lambda fraction, words: None)
    told(0.0, "fitting the model")
    fitted = present = fit_model(record, model)
    added: list[tuple[Term, int]] = []
    refused = set(without)
    evidence: dict[tuple[str, int], Finding] = {}
    look = first = Look.at(present)
    found = [look.selection.findings(joint) for joint in range(record.joints)]
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
        chosen = look.selection.additions(open_) if index < MOST_LOOKS - 1 else []
        if not chosen:
            exchanged = _exchanged(look, added, refused) if index < MOST_LOOKS - 1 else None
            if exchanged is None:
                break
            added = exchanged
        for candidate, variant in chosen:
            added.append((candidate.term.chosen(candidate.constants[variant]), candidate.judged))
            evidence.update({f.candidate.key: f for own in open_ for f in own if f.candidate is candidate})
        present = _fit_with(record, fitted, added)
        added = _settled(present, added)
    floors = noise_floors(record)
    joints = tuple(
        _conclude(
            first,
            look,
            joint,
            found[joint],
            tuple(t for t, judged in added if judged == joint),
            evidence,
            floors[joint],
        )
        for joint in range(record.joints)
    )
    told(1.0, "done")
    named = {(term.effect.name, joint.joint) for joint in joints for term in joint.missing}
    told_missing = tuple(t for t, judged in added if (t.effect.name, record.joint_names[judged]) in named)
    return Diagnosis(record.experiment, name, fitted, present, joints, told_missing, tuple(first.left_out))


def _fit_with(record: Record, fitted: FittedModel, added: Sequence[tuple[Term, int]]) -> FittedModel:
    """The diagnosed model with the added terms, their constants searched around what was found."""
    return fit_model(record, fitted.model.with_terms(term for term, _ in added), refine=True)


def _exchanged(
    look: Look, added: Sequence[tuple[Term, int]], refused: set[tuple[str, int]]
) -> list[tuple[Term, int]] | None:
    """The added terms with one that imitated another effect exchanged for it; None where there is none.

    What was exchanged does not come back.
    """
    for place, (term, _) in enumerate(added):
        better = look.replacement(term) if len(added) > 1 else None
        if better is not None and better[0].key not in refused:
            refused.add(term.key)
            return [*added[:place], better, *added[place + 1 :]]
    return None


def _settled(present: FittedModel, added: Sequence[tuple[Term, int]]) -> list[tuple[Term, int]]:
    """The added terms with the constants of the present fit."""
    constants = {term.key: term for term in present.model.terms}
    return [(constants[term.key], judged) for term, judged in added]


def _rivals(look: Look, found: Sequence[Finding]) -> dict[str, tuple[str, ...]]:
    named: dict[str, tuple[str, ...]] = {}
    if found and found[0].justified:
        rivals = look.selection.rivals(found[0], found)
        named[found[0].candidate.name] = rivals
        for rival in rivals:
            named[rival] = (found[0].candidate.name,)
    return named


def _conclude(
    look: Look,
    final: Look,
    joint: int,
    findings: Sequence[Finding],
    missing: tuple[Term, ...],
    evidence: dict[tuple[str, int], Finding],
    floor: float | None,
) -> JointDiagnosis:
    before, after = look.predictions[joint], final.predictions[joint]
    structure = tuple(leftover_structure(after))
    said = verdict(mean_error(before), mean_error(after), floor, structure, bool(missing))
    variable, free = look.best_free_function(joint)
    where = where_it_fails(before)
    if imitated(final.selection.held_out_error(joint), free, len(missing)):
        said, missing = "unexplained", ()
        where.sort(key=lambda row: row["variable"] != variable)
    return JointDiagnosis(
        joint=look.fitted.record.joint_names[joint],
        verdict=said,
        missing=missing,
        evidence=tuple(
            evidence[term.effect.name, joint] for term in missing if (term.effect.name, joint) in evidence
        ),
        findings=tuple(_missing_first(findings, [term.effect.name for term in missing])),
        rivals=_rivals(look, findings),
        structure=structure,
        where=where,
        noise_floor=floor,
        superfluous=look.superfluous(joint),
    )


def mean_error(predictions: Sequence[Prediction]) -> float:
    """Relative error of a joint over several sessions."""
    residual = np.concatenate([part.residual[part.moving] for part in predictions])
    return relative_error(residual, np.concatenate([part.measured[part.moving] for part in predictions]))


def _missing_first(findings: Sequence[Finding], missing: Sequence[str]) -> list[Finding]:
    """Findings with the strongest missing effect in front, so that rank 1 is what would be added first."""
    if not missing:
        return list(findings)
    front = [finding for finding in findings if finding.candidate.name == missing[0]]
    return front + [finding for finding in findings if finding.candidate.name != missing[0]]


def _candidate_json(finding: Finding, rank: int, rivals: Sequence[str]) -> dict[str, Any]:
    effect = finding.candidate.term.effect
    measured = max(finding.measured, 1e-300)

    def error(square: float) -> float | None:
        return number(float(np.sqrt(max(square, 0.0) / measured)))

    return {
        "effect": effect.name,
        "rank": rank,
        "relative_error_before": error(finding.before.trained),
        "relative_error_after": error(finding.after.trained),
        "heldout_error_before": error(finding.before.total),
        "heldout_error_after": error(finding.after.total),
        "p_value": finding.p_value,
        "justified": finding.justified,
        "indistinguishable_from": list(rivals),
        "explanation": effect.explanation,
        "equation": effect.equation,
        "variable": effect.variable,
        "constants": finding.candidate.constants[finding.variant],
    }
