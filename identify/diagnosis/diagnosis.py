"""`diagnose`: where a model fails and which physical effect is missing."""

from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from identify.diagnosis.candidates import Candidate, find_candidates
from identify.diagnosis.position_lines import position_lines
from identify.diagnosis.selection import Finding, Selection
from identify.diagnosis.structure import Structure, leftover_structure
from identify.diagnosis.where import where_it_fails
from identify.effects.model import Model, Term
from identify.effects.motion import JointSummary
from identify.estimation.fitting import FittedModel, Progress, fit_model
from identify.estimation.identification import known_effects, number, open_record, requested_model
from identify.estimation.observation import observe
from identify.estimation.prediction import Prediction, predict
from identify.estimation.record import Record
from identify.recording import Experiment
from identify.validation.noise_floor import noise_floors

Array = NDArray[np.float64]

AT_THE_FLOOR = 1.05
"""An error within this factor of the noise floor leaves nothing to explain."""


@dataclass(frozen=True)
class JointDiagnosis:
    """What is said of one joint.

    verdict   : missing, adequate or unexplained
    missing   : effects that are justified, the strongest first
    findings  : every candidate beside the model, the best first
    structure : what a predictor without any model still finds, after the missing effects are added
    """

    joint: str
    verdict: str
    missing: tuple[Term, ...]
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


def diagnose_record(record: Record, name: str, model: Model, progress: Progress | None = None) -> Diagnosis:
    """`diagnose` on an open record."""
    told = progress or (lambda fraction, words: None)
    told(0.0, "fitting the model")
    fitted = fit_model(record, model)
    predictions = joint_predictions(fitted)
    told(0.2, "computing the columns of every candidate effect")
    summaries = informed_summaries(fitted, predictions)
    first = len(fitted.slots)
    candidates, left_out = find_candidates(
        record, fitted.model, known_effects(record.experiment), summaries, first
    )
    slots = [*fitted.slots, *(slot for candidate in candidates for slot in candidate.slots())]
    observation = observe(record, fitted.entries, slots, fitted.torque)
    told(0.5, "judging every candidate on motion that the fit did not see")
    ratio = first - 1 if fitted.estimates_payload_ratio else None
    selection = Selection(
        observation,
        fitted.fit.weights,
        candidates,
        np.concatenate(
            [np.arange(observation.base)] + [observation.slot_columns[i] for i in range(first) if i != ratio]
        ).astype(np.intp),
        observation.slot_columns[ratio] if ratio is not None else np.zeros(0, np.intp),
    )
    alone = [selection.findings(joint) for joint in range(record.joints)]
    rivals = [_rivals(selection, found) for found in alone]
    selection.run(range(record.joints))
    told(0.8, "looking at what is left")
    added = [_term(candidate, variant) for candidate, variant in selection.added]
    better = fitted
    if added:
        better = fit_model(record, fitted.model.with_terms(_reopened(added)))
    after = joint_predictions(better) if added else predictions
    floors = noise_floors(record)
    joints = tuple(
        _conclude(
            record,
            selection,
            joint,
            alone[joint],
            rivals[joint],
            predictions[joint],
            after[joint],
            floors[joint],
        )
        for joint in range(record.joints)
    )
    told(1.0, "done")
    return Diagnosis(record.experiment, name, fitted, better, joints, tuple(left_out))


def joint_predictions(fitted: FittedModel) -> list[list[Prediction]]:
    """For every joint its predictions in the sessions of the fit."""
    by_session = [predict(fitted, entry) for entry in fitted.entries]
    return [list(parts) for parts in zip(*by_session, strict=True)]


def informed_summaries(
    fitted: FittedModel, predictions: Sequence[Sequence[Prediction]]
) -> list[JointSummary]:
    """The joints' summaries with the range of the fitted load and the lines over position."""
    record = fitted.record
    found = []
    for summary, parts in zip(record.summaries, predictions, strict=True):
        load = np.concatenate([part.predicted for part in parts])
        lines = position_lines(parts, summary, record.settings.decimation_cutoff)
        found.append(
            replace(
                summary,
                load_range=(float(load.min()), float(load.max())),
                position_lines=lines.torque,
                load_lines=lines.gain,
                lines_searched=lines.searched,
            )
        )
    return found


def _term(candidate: Candidate, variant: int) -> Term:
    return candidate.term.chosen(candidate.constants[variant])


def _reopened(terms: Sequence[Term]) -> list[Term]:
    """The terms with their constants as they were found; a fit keeps them."""
    return list(terms)


def _rivals(selection: Selection, found: Sequence[Finding]) -> dict[str, tuple[str, ...]]:
    named: dict[str, tuple[str, ...]] = {}
    if found and found[0].justified:
        rivals = selection.rivals(found[0], found)
        named[found[0].candidate.name] = rivals
        for rival in rivals:
            named[rival] = (found[0].candidate.name,)
    return named


def _conclude(
    record: Record,
    selection: Selection,
    joint: int,
    findings: Sequence[Finding],
    rivals: dict[str, tuple[str, ...]],
    before: Sequence[Prediction],
    after: Sequence[Prediction],
    floor: float | None,
) -> JointDiagnosis:
    missing = tuple(_term(c, v) for c, v in selection.added if c.judged == joint)
    structure = tuple(leftover_structure(after))
    ordered = _missing_first(findings, [term.effect.name for term in missing])
    error = np.sqrt(sum(float(p.residual[p.moving] @ p.residual[p.moving]) for p in after))
    norm = np.sqrt(sum(float(p.measured[p.moving] @ p.measured[p.moving]) for p in after))
    at_floor = floor is not None and norm > 0 and error / norm < AT_THE_FLOOR * floor
    if missing:
        verdict = "missing"
    elif structure and structure[0].found and not at_floor:
        verdict = "unexplained"
    else:
        verdict = "adequate"
    return JointDiagnosis(
        joint=record.joint_names[joint],
        verdict=verdict,
        missing=missing,
        findings=tuple(ordered),
        rivals=rivals,
        structure=structure,
        where=where_it_fails(before),
        noise_floor=floor,
        superfluous=_superfluous(selection, joint),
    )


def _missing_first(findings: Sequence[Finding], missing: Sequence[str]) -> list[Finding]:
    """Findings with the strongest missing effect in front, so that rank 1 is what would be added first."""
    if not missing:
        return list(findings)
    front = [finding for finding in findings if finding.candidate.name == missing[0]]
    return front + [finding for finding in findings if finding.candidate.name != missing[0]]


def _superfluous(selection: Selection, joint: int) -> tuple[str, ...]:
    """Terms of the model whose columns do not lower the held-out error of the joint."""
    observation = selection.observation
    named = []
    for slot, columns in zip(observation.slots, observation.slot_columns, strict=True):
        if not np.isin(columns, selection.model_columns).all() or slot.term.joint != joint:
            continue
        base = np.setdiff1d(selection.base(), columns)
        if selection.worth(joint, base, columns) <= 0:
            named.append(slot.term.effect.name)
    return tuple(named)


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
