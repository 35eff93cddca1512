"""`diagnose`: where a model fails and which physical effect is missing."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import count

import numpy as np
from numpy.typing import NDArray

from identify.diagnosis.caution import caution, load_siblings
from identify.diagnosis.deciding_constants import MOST, NEARLY_ALL
from identify.diagnosis.description import Describer
from identify.diagnosis.finding import Finding
from identify.diagnosis.joint_diagnosis import JointDiagnosis
from identify.diagnosis.motion_judgement import effects_on_motion
from identify.diagnosis.moves import Fits, State, exchanged, verified, without_harmful
from identify.diagnosis.probability import independent_samples, joint_probabilities
from identify.diagnosis.refusals import Key, Refusals
from identify.diagnosis.sampling_hold import made_by_recording
from identify.diagnosis.screening import Screening
from identify.diagnosis.structure import Structure, bounded, leftover_structures
from identify.diagnosis.unseen_sessions import fails_on_unseen
from identify.diagnosis.verdict import imitated, left_over, part_of_free, verdict
from identify.diagnosis.where import where_it_fails
from identify.effects.model import Model, Term, model_name
from identify.estimation import forked
from identify.estimation.doubts import cut_commands
from identify.estimation.fitted_model import FittedModel
from identify.estimation.fitting import Progress, fit_model
from identify.estimation.prediction import Prediction, mean_error, predict_sessions
from identify.estimation.record import Record
from identify.estimation.requested_model import known_effects, open_record, requested_model
from identify.estimation.small_algebra import single_threaded
from identify.recording import Experiment
from identify.results.diagnosis import DiagnosisDocument, NotApplicable
from identify.results.document import Json
from identify.results.unseen_motion import EffectOnMotion
from identify.validation.noise_floor import NoiseFloor, noise_floors

Array = NDArray[np.float64]

STEP_OF_PROGRESS = 0.12
"""Part of what is left of the progress bar that a round takes: nobody knows beforehand how many there will be."""


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
    motion: tuple[EffectOnMotion, ...] | None = None
    """what the missing effects do to the prediction of motion; None where it was not asked for"""

    def document(self) -> DiagnosisDocument:
        """The contract's `diagnose --json`, section 3."""
        floors = [None if (floor := joint.noise_floor) is None else floor.value for joint in self.joints]
        return DiagnosisDocument(
            experiment=self.experiment.name,
            model=self.model,
            relative_error=self.fitted.fit.relative_error,
            relative_error_with_missing=self.better.fit.relative_error,
            noise_floor=overall_floor(floors, self.fitted.fit.norm),
            joints=tuple(joint.document() for joint in self.joints),
            not_applicable=self.left_out,
            motion=self.motion,
            remarks=tuple(cut_commands(self.fitted.record)),
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


@single_threaded
def diagnose(
    experiment: Experiment,
    model: str = "usual",
    add: Sequence[str] = (),
    progress: Progress | None = None,
    motion: bool = False,
) -> Diagnosis:
    """Say where a model fails and which physical effect is missing.

    motion : also say what each missing effect does to the prediction of motion that the fit did not see
    Raises InputError: the experiment, the model or an effect is wrong.
    """
    model = model_name(model)
    record = open_record(experiment, model)
    asked = requested_model(record, model, add)
    with forked.side_by_side(record.joints):
        result = with_descriptions(diagnose_record(record, model, asked, progress))
    return replace(result, motion=effects_on_motion(result.fitted, result.added)) if motion else result


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

    Look at every candidate beside the model, add the strongest, fit again, take out what is not justified beside the
    others any more, exchange what only imitated another, and look again until nothing changes: the load that candidates
    depend on, and what others hide, are then seen better. It ends, for what was taken out comes back once at most.
    """
    report = progress or (lambda fraction, step: None)
    report(0.0, "fitting the model")
    fitted = fit_model(record, model)
    fits = Fits(fitted)
    refusals = Refusals(set(without))
    harmful: set[Key] = set()
    forward: dict[Key, Finding] = {}
    doubts: dict[Key, tuple[str, ...]] = {}
    contested: dict[Key, tuple[Finding, ...]] = {}
    tried: set[tuple[Key, Key]] = set()
    first = Screening.of(fitted)
    least = [first.least(joint) for joint in range(record.joints)]
    here = State.of(first, [], {}, refusals, least)
    first_findings = here.listed
    best: State | None = here
    for index in count():
        done = 0.9 - 0.8 * (1 - STEP_OF_PROGRESS) ** index
        report(done, "judging every candidate on motion that the fit did not see")
        present, added = here.present, list(here.added)
        for candidate, variant in here.chosen:
            findings = here.listed[candidate.judged]
            doubts[candidate.key] = _rivals(here.screening, _finding(findings, candidate.name), findings)
            forward[candidate.key] = _finding(findings, candidate.name)
            contested[candidate.key] = tuple(
                _finding(findings, name) for name in (candidate.name, *doubts[candidate.key])
            )
            added.append((candidate.term.chosen(candidate.constants[variant]), candidate.judged))
        if here.chosen:
            present, added = fits(added, present)
        else:
            present, added = without_harmful(fits, present, added, refusals, harmful)
            if len(added) < len(here.added):
                best = None  # the search was no better off with what does harm
            elif best is not None and best.better_than(here):
                here = best = best.again(refusals, least)
                continue
            else:
                other = exchanged(here, fits, refusals, doubts, tried)
                if other is None:
                    break
                present, added = fits(other, present)
        here = verified(fits, present, added, refusals, least)
        if best is None or here.better_than(best):
            best = here
    if (settled := fits.settled(here.present, here.added)) is not None:
        again = verified(fits, *settled, refusals, least)
        here = again if len(again.added) == len(here.added) else here
    screening, present, added = here.screening, here.present, list(here.added)
    held = {term.key: reason for term, _ in added if (reason := made_by_recording(present, term))}
    added.sort(key=lambda row: row[0].key in held)
    floors = noise_floors(
        record,
        {
            entry.file: np.column_stack([parts[place].residual for parts in screening.predictions])
            for place, entry in enumerate(present.entries)
        },
    )
    checked = predict_sessions(present, record.entries("validation"))
    unseen = [[parts[joint] for parts in checked] for joint in range(record.joints)]
    structures = leftover_structures(screening.predictions)
    joints = tuple(
        _conclude(
            first,
            screening,
            joint,
            first_findings[joint],
            tuple(t for t, judged in added if judged == joint),
            held,
            here.evidence,
            forward,
            screening.with_evidence(joint, here.listed[joint], least[joint]),
            floors[joint],
            unseen[joint],
            {name: named for (name, judged), named in doubts.items() if judged == joint},
            {name: compared for (name, judged), compared in contested.items() if judged == joint},
            least[joint],
            tuple(structures[joint]),
            {name for name, owner in harmful & set(refusals.present(added)) if owner == joint},
        )
        for joint in range(record.joints)
    )
    report(1.0, "done")
    named = {(term.effect.name, joint.joint) for joint in joints for term in joint.missing}
    missing = tuple(t for t, judged in added if (t.effect.name, record.joint_names[judged]) in named)
    return Diagnosis(record.experiment, name, fitted, present, joints, missing, tuple(first.left_out))


def with_descriptions(diagnosis: Diagnosis, of_doubted_only: bool = False) -> Diagnosis:
    """The diagnosis with a description, where one holds, of what a joint's missing effects do not explain.

    of_doubted_only : only where a description may stand in the place of what is missing
    """
    wanted = [
        place
        for place, joint in enumerate(diagnosis.joints)
        if (joint.doubted is not None or (joint.open and not of_doubted_only))
        and not joint.beyond_description
    ]
    if not wanted:
        return diagnosis
    describer = Describer.of(diagnosis.better, diagnosis.fitted)
    joints, gone = list(diagnosis.joints), set[tuple[str, int]]()
    offers = forked.each(lambda place: describer.offer(place, diagnosis.joints[place]), wanted)
    for place, offered in zip(wanted, offers, strict=True):
        if offered is None:
            joints[place] = replace(joints[place], beyond_description=True)
        else:
            gone |= offered.replaces
            names = {name for name, _ in offered.replaces}
            joints[place] = joints[place].described(offered.document, names)
    added = tuple(term for term in diagnosis.added if term.key not in gone)
    return replace(diagnosis, joints=tuple(joints), added=added)


def _finding(findings: Sequence[Finding], name: str) -> Finding:
    return next(finding for finding in findings if finding.candidate.name == name)


def _rivals(screening: Screening, finding: Finding, findings: Sequence[Finding]) -> tuple[str, ...]:
    """Effects that explain the data as well as one that was found, or that only a change of load would tell from it."""
    candidate = finding.candidate
    record = screening.fitted.record
    known = known_effects(record.experiment)
    siblings = load_siblings(candidate.term.effect, known, record.summaries[candidate.judged])
    named = list(screening.selection.rivals(finding, findings)) if finding.justified else []
    for other in findings:
        name = other.candidate.name
        if name in siblings and name not in named and other.gain > MOST * finding.gain > 0:
            named.append(name)
    return tuple(named)


def _both_ways(
    findings: Sequence[Finding],
    missing: Sequence[str],
    strongest: tuple[str, ...],
    doubts: dict[str, tuple[str, ...]],
) -> dict[str, tuple[str, ...]]:
    """Rivals by effect, each named at the other: those of what is missing, and of the strongest candidate.

    Two effects that are both missing are no rivals: each helps beside the other.
    """
    pairs = {(name, rival) for name in missing for rival in doubts.get(name, ())}
    if findings:
        pairs |= {(findings[0].candidate.name, rival) for rival in strongest}
    pairs = {pair for pair in pairs if not set(pair) <= set(missing)}
    order = [finding.candidate.name for finding in findings]
    return {
        name: tuple(rival for rival in order if (name, rival) in pairs or (rival, name) in pairs)
        for name in order
        if any(name in pair for pair in pairs)
    }


def _conclude(
    first: Screening,
    final: Screening,
    joint: int,
    findings: Sequence[Finding],
    missing: tuple[Term, ...],
    held: dict[tuple[str, int], str],
    evidence: dict[Key, Finding],
    forward: dict[Key, Finding],
    last: Sequence[Finding],
    floor: NoiseFloor | None,
    unseen: Sequence[Prediction],
    doubts: dict[str, tuple[str, ...]],
    contested: dict[str, tuple[Finding, ...]],
    least: float,
    structure: tuple[Structure, ...],
    harmful: set[str],
) -> JointDiagnosis:
    sampling = tuple(term for term in missing if term.key in held)
    missing = tuple(term for term in missing if term.key not in held)
    before, after = first.predictions[joint], final.predictions[joint]
    outcome = verdict(mean_error(before), mean_error(bounded(after)), floor, structure, bool(missing))
    function = first.best_free_function(joint)
    variable, free = function.variable, function.error
    parameters = sum(each.complexity for key, each in evidence.items() if key[1] == joint)
    failing = unseen if outcome == "adequate" and fails_on_unseen(after, unseen) else []
    outcome = "unexplained" if failing else outcome
    where = where_it_fails([*before, *failing])
    of_one_variable = all(term.effect.variable == variable for term in missing)
    part = _part_of_free(missing, forward, joint, free)
    error = final.selection.held_out_error(joint)
    over = of_one_variable and left_over(variable, structure, mean_error(bounded(after)))
    lead = function.lead_over(parameters)
    if imitated(error, free, len(missing), of_one_variable, over, lead) and part < NEARLY_ALL:
        keeps_its_name = part > MOST and missing[0].effect.variable == variable
        outcome, missing = "unexplained", missing[:1] if keeps_its_name else ()
        where = tuple(sorted(where, key=lambda row: row.variable != variable))
    if missing:
        missing = (*missing, *sampling)
    names = [term.effect.name for term in missing]
    strongest = _rivals(first, findings[0], findings) if findings and findings[0].justified else ()
    record = first.fitted.record
    known, summary = known_effects(record.experiment), record.summaries[joint]
    effects = [finding.candidate.term.effect for finding in findings]
    cautions = {effect.name: caution(effect, known, summary) for effect in effects}
    cautions.update({term.effect.name: held[term.key] for term in sampling})
    worth = {name: evidence[name, joint] for name in names if (name, joint) in evidence}
    rivals = _both_ways(findings, names, strongest, doubts)
    return JointDiagnosis(
        joint=record.joint_names[joint],
        verdict=outcome,
        missing=missing,
        evidence=tuple(worth.values()),
        findings=tuple(_missing_first(_as_justified(findings, worth), names)),
        rivals=rivals,
        probable=joint_probabilities(
            last, independent_samples(after), worth, rivals, structure, outcome, contested, least, harmful
        ),
        cautions={name: text for name, text in cautions.items() if text},
        structure=structure,
        where=where,
        noise_floor=floor,
        superfluous=first.superfluous(joint),
        doubted=final.doubted(joint, missing) if outcome == "missing" else None,
    )


def _part_of_free(
    missing: Sequence[Term],
    evidence: dict[Key, Finding],
    joint: int,
    free: float,
) -> float:
    """How much of what the best free function takes away the strongest missing effect does."""
    first = evidence.get((missing[0].effect.name, joint)) if missing else None
    if first is None:
        return 0.0
    return part_of_free(first.relative(first.before.total), first.relative(first.after.total), free)


def _as_justified(findings: Sequence[Finding], missing: Mapping[str, Finding]) -> list[Finding]:
    """Findings beside the diagnosed model; of a missing effect that stands out only beside the other missing ones, what
    it is worth beside these."""
    return [
        finding if finding.justified else missing.get(finding.candidate.name, finding) for finding in findings
    ]


def _missing_first(findings: Sequence[Finding], missing: Sequence[str]) -> list[Finding]:
    """Findings with the strongest missing effect in front, so that rank 1 is what would be added first."""
    if not missing:
        return list(findings)
    front = [finding for finding in findings if finding.candidate.name == missing[0]]
    return front + [finding for finding in findings if finding.candidate.name != missing[0]]
