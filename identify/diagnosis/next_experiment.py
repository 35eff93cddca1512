"""`next`: the experiment that would separate two rival explanations best.

Two effects that explain the data alike predict different torques on other motion. For every experiment that the rig can
run (payload, speed, range, repeats) the torque that one of them predicts is fitted by the model with the other, on the
data so far and the new motion together; what this fit cannot follow, in units of the noise, is the separation to
expect (`separation.py`).
"""

from __future__ import annotations

import tempfile
from collections.abc import Iterator, Sequence
from functools import partial
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from identify.diagnosis.diagnosis import Diagnosis, diagnose_record
from identify.diagnosis.finding import Finding
from identify.diagnosis.rival_question import Question
from identify.diagnosis.separation import Apart, expected_share
from identify.effects.model import Model, Term, model_name, terms_of
from identify.estimation.executor import SERIAL, chosen_executor, computed_by
from identify.estimation.fitting import fit_model
from identify.estimation.least_squares import joint_rows
from identify.estimation.observation import observe
from identify.estimation.record import Record
from identify.estimation.requested_model import known_effects, open_record, requested_model
from identify.estimation.small_algebra import single_threaded
from identify.recording import (
    DeclaredSession,
    Experiment,
    ExperimentFile,
    Joint,
    load_experiment,
    write_experiment,
)
from identify.results.diagnosis import Candidate, DiagnosisDocument
from identify.results.next_experiment import NextExperimentDocument, Proposal, Shape

Array = NDArray[np.float64]
Index = NDArray[np.intp]

SHAPES: tuple[Shape, ...] = ("sinusoid", "trapezoid")
SPEEDS = (0.03, 0.1, 0.3, 0.7, 1.0)
"""parts of the top speed"""
RANGES = (1.0, 0.5, 0.1)
"""parts of the range of position"""
DURATION = 20.0
"""s of motion of each experiment that is looked at"""
RATE = 250.0
"""Hz; the motion is smooth, and only its filtered columns count"""
SEPARATED = 5.0
"""Standard deviations by which rivals of which none contains the other must part for the experiment to decide between them;
others must have the share that is expected then."""
HELPS = 1.0
"""standard deviations below which no motion that was looked at is worth running for this question"""
USUAL_ACCELERATION = 0.99
"""Quantile of the acceleration that a joint has shown, which no proposal exceeds where no limit is declared."""
SHOWN = 5
"""proposals in the answer"""


def next_experiment(
    experiment: Experiment, model: str = "usual", add: Sequence[str] = (), rivals: Sequence[str] = ()
) -> NextExperimentDocument:
    """Plan the experiment that separates the rivals that the diagnosis left, or two effects that are named.

    Raises InputError: the experiment, the model or an effect is wrong.
    """
    model = model_name(model)
    record = open_record(experiment, model)
    diagnosis = diagnose_record(record, model, requested_model(record, model, add))
    return separate(record, diagnosis, rivals)


def separate(record: Record, diagnosis: Diagnosis, wanted: Sequence[str] = ()) -> NextExperimentDocument:
    """`next_experiment` from a diagnosis that was made already."""
    chosen = _rivals(diagnosis, wanted)
    if chosen is None:
        advice = _advice_without_rivals(diagnosis)
        return NextExperimentDocument(
            experiment=record.experiment.name,
            joint=None,
            rivals=(),
            separation_so_far=None,
            probability_so_far=None,
            proposals=(),
            posture=(),
            advice=advice,
        )
    joint, pair = chosen
    constants = {finding.candidate.term.key: finding.candidate.constants[finding.variant] for finding in pair}
    terms = [finding.candidate.term.chosen(constants[finding.candidate.term.key]) for finding in pair]
    cautions = diagnosis.joints[joint].cautions
    cautious = next((cautions[term.effect.name] for term in terms if term.effect.name in cautions), "")
    return separate_terms(record, diagnosis.fitted.model, joint, terms, diagnosis.added, cautious)


def separate_diagnosed(
    record: Record, model: Model, diagnosis: DiagnosisDocument, name: str
) -> NextExperimentDocument | None:
    """`separate` for one joint from a diagnosis that was stored; None where it left no rivals there.

    model : the model that was diagnosed
    name  : the joint
    """
    diagnosed = diagnosis.joint(name)
    if diagnosed is None:
        return None
    candidates = {candidate.effect: candidate for candidate in diagnosed.candidates}
    strongest = [candidate.effect for candidate in diagnosed.candidates[:1] if candidate.justified]
    pairs = [
        (effect, rival)
        for effect in [*diagnosed.missing, *strongest]
        if effect in candidates
        for rival in candidates[effect].indistinguishable_from
        if rival in candidates
    ]
    if not pairs:
        return None
    known = known_effects(record.experiment)

    def term_of(candidate: Candidate, joint: int) -> Term:
        terms = terms_of(known[candidate.effect], [joint], record.experiment.drive_gain)
        return terms[0].chosen(dict(candidate.constants))

    joint = record.joint_names.index(name)
    pair = [candidates[effect] for effect in pairs[0]]
    terms = [term_of(candidate, joint) for candidate in pair]
    beside = [
        term_of(candidate, record.joint_names.index(other.joint))
        for other in diagnosis.joints
        for candidate in other.evidence
    ]
    cautious = next((candidate.caution for candidate in pair if candidate.caution), "")
    return separate_terms(record, model, joint, terms, beside, cautious)


@single_threaded
def separate_terms(
    record: Record,
    model: Model,
    joint: int,
    terms: Sequence[Term],
    missing: Sequence[Term],
    cautious: str = "",
) -> NextExperimentDocument:
    """The experiment that separates two effects of a joint, their constants chosen.

    model    : the model that was diagnosed
    missing  : everything that was found missing beside it, on all joints
    cautious : what to say of the two where no motion separates them
    """
    keys = {term.key for term in terms}
    beside = [term for term in missing if term.key not in keys]
    base = fit_model(record, model.with_terms(beside))
    fits = [fit_model(record, base.model.with_terms([term])) for term in terms]
    question = Question.of(record, fits, terms, joint, base)
    so_far = question.apart(question.known)
    now, share_now = so_far.separation, expected_share(so_far)
    enough = expected_share(Apart(SEPARATED))
    options = list(_options(record, joint))
    expected = chosen_executor()(
        partial(_expected, question), [(motion, payload) for payload, *_, motion in options]
    )
    proposals = []
    for (payload, speed, low, high, shape, repeats, _), apart in zip(options, expected, strict=True):
        separation, share = apart.separation, expected_share(apart)
        proposal = Proposal(
            payload=payload,
            shape=shape,
            speed=speed,
            position_from=low,
            position_to=high,
            repeats=repeats,
            separation=separation,
            probability=share,
            decides=share >= enough,
        )
        proposals.append((separation, proposal))
    proposals.sort(key=lambda pair: pair[0], reverse=True)
    return NextExperimentDocument(
        experiment=record.experiment.name,
        joint=record.joint_names[joint],
        rivals=tuple(term.effect.name for term in terms),
        separation_so_far=now,
        probability_so_far=share_now,
        proposals=tuple(proposal for _, proposal in proposals[:SHOWN]),
        posture=tuple(_posture(record).tolist()),
        advice=_advice(record, joint, terms, so_far, proposals[0][1] if proposals else None, cautious),
    )


def _rivals(diagnosis: Diagnosis, wanted: Sequence[str]) -> tuple[int, tuple[Finding, Finding]] | None:
    """The joint and the two findings to separate."""
    for joint, diagnosed in enumerate(diagnosis.joints):
        by_name = {finding.candidate.name: finding for finding in diagnosed.findings}
        if len(wanted) == 2 and all(name in by_name for name in wanted):
            return joint, (by_name[wanted[0]], by_name[wanted[1]])
        doubtful = [term.effect.name for term in diagnosed.missing]
        doubtful += [finding.candidate.name for finding in diagnosed.findings[:1] if finding.justified]
        for name in doubtful:
            rivals = [rival for rival in diagnosed.rivals.get(name, ()) if rival in by_name]
            if not wanted and name in by_name and rivals:
                return joint, (by_name[name], by_name[rivals[0]])
    return None


def _posture(record: Record) -> Array:
    """(n,) where the joints were on average."""
    return np.mean(np.vstack([part.q for part in record.samples.values()]), axis=0)


def _options(record: Record, joint: int) -> Iterator[tuple[str, float, float, float, Shape, int, Array]]:
    """Experiments within the limits: payload, speed, from, to, shape, repeats and the positions (samples, n)."""
    description: Joint = record.experiment.robot.joints[joint]
    summary = record.summaries[joint]
    low, high = summary.position_range
    top = summary.maximum_speed
    limits = description.limits
    shown = np.concatenate(
        [np.abs(part.ddq[part.moving[:, joint], joint]) for part in record.samples.values()]
    )
    strongest = float(np.quantile(shown, USUAL_ACCELERATION))
    if limits is not None:
        low, high = limits.position or (low, high)
        top = limits.velocity or top
        strongest = limits.acceleration or strongest
    others = _posture(record)
    for payload in record.experiment.payloads:
        for part in SPEEDS:
            for span in RANGES:
                middle, half = 0.5 * (low + high), 0.5 * span * (high - low)
                for shape in SHAPES:
                    repeats, course = _course(shape, part * top, middle, half)
                    acceleration = np.gradient(np.gradient(course, 1 / RATE), 1 / RATE)
                    if repeats < 1 or np.abs(acceleration).max() > strongest:
                        continue
                    motion = np.tile(others, (len(course), 1))
                    motion[:, joint] = course
                    yield payload.name, part * top, middle - half, middle + half, shape, repeats, motion


def _course(shape: Shape, speed: float, middle: float, half: float) -> tuple[int, Array]:
    """Positions between middle ± half at up to `speed`, whole repeats within `DURATION`; smooth at the ends."""
    time = np.arange(round(DURATION * RATE)) / RATE
    if shape == "sinusoid":
        frequency = speed / (2 * np.pi * half)
        repeats = int(DURATION * frequency)
        return repeats, middle - half * np.cos(2 * np.pi * frequency * time)
    period = 4 * half / speed * 1.2
    repeats = int(DURATION / period)
    # a trapezoid of velocity with a tenth of each way for speeding up and slowing down, its corners rounded
    phase = (time / period) % 1.0
    edge = 0.04
    rise = np.clip(np.minimum(phase, 0.5 - phase) / edge, 0, 1) - np.clip(
        np.minimum(phase - 0.5, 1 - phase) / edge, 0, 1
    )
    position = np.cumsum(np.sin(0.5 * np.pi * rise)) / RATE
    position -= np.linspace(0, position[-1], len(position)) if repeats else 0.0
    size = np.ptp(position)
    return repeats, middle - half + 2 * half * (position - position.min()) / (size if size > 0 else 1.0)


def _expected(question: Question, option: tuple[Array, str]) -> Apart:
    """How far the rivals part with a new motion added to the data so far: its positions (samples, n), and the payload's name."""
    record = question.record
    # The scratch folder is here, whatever the record's own sessions are reduced by.
    with tempfile.TemporaryDirectory() as scratch, computed_by(SERIAL):
        planned = _planned_experiment(record.experiment, Path(scratch), *option)
        imagined = Record(planned, record.settings, record.body)
        rows = joint_rows(
            observe(imagined, imagined.entries(), question.slots, question.torque), question.joint
        )
    return question.apart(np.vstack([question.known, rows]))


def _planned_experiment(experiment: Experiment, folder: Path, motion: Array, payload: str) -> Experiment:
    """An experiment whose one session is the planned motion, its commands unknown (zero)."""
    n = motion.shape[1]
    header = ",".join(["t", *(f"q{i + 1}" for i in range(n)), *(f"v{i + 1}" for i in range(n))])
    table = np.column_stack([np.arange(len(motion)) / RATE, motion, np.zeros_like(motion)])
    np.savetxt(folder / "planned.csv", table, delimiter=",", header=header, comments="", fmt="%.9g")
    file = ExperimentFile(
        format=1,
        name="planned",
        robot=experiment.robot,
        payloads=experiment.payloads,
        sessions=(DeclaredSession(file="planned.csv", payload=payload),),
    )
    write_experiment(folder, file)
    return load_experiment(folder)


def _advice_without_rivals(diagnosis: Diagnosis) -> str:
    lacking: dict[str, list[str]] = {}
    for each in diagnosis.left_out:
        names = lacking.setdefault(each.reason, [])
        if each.effect not in names:
            names.append(each.effect)
    if not lacking:
        return "No rivals are left: the diagnosis is not in doubt."
    listed = "; ".join(f"{', '.join(names)} ({reason})" for reason, names in sorted(lacking.items()))
    return f"No rivals are left. Effects that these data cannot show: {listed}."


def _advice(
    record: Record, joint: int, terms: Sequence[Term], so_far: Apart, best: Proposal | None, cautious: str
) -> str:
    """What to do, in words, from the best proposal and the separation that it promises."""
    name, pair = record.joint_names[joint], " from ".join(term.effect.name for term in terms)
    if best is None or (best.separation or 0.0) < HELPS:
        advice = f"With these payloads and within the limits no motion of {name} separates {pair}."
        return " ".join([advice, cautious or _checks(terms)]).strip()
    share_so_far = expected_share(so_far)
    unit = "rad" if record.summaries[joint].revolute else "m"
    word = "tells" if best.decides else "helps most to tell, but does not decide,"
    return (
        f"A {best.shape} of {name} between {best.position_from:.3g} and {best.position_to:.3g} {unit} at up to"
        f" {best.speed:.3g} {unit}/s with payload {best.payload}, {best.repeats} repeats, {word} {pair}:"
        f" {best.separation or 0.0:.1f} standard deviations (the data so far: {so_far.separation:.1f}), with which the"
        f" diagnosis is expected to give the right one {best.probability or 0.0:.2f} of what it gives both"
        f" (so far {share_so_far:.2f})."
    )


def _checks(terms: Sequence[Term]) -> str:
    """What to look at on the machine, from the effects' own explanations."""
    checks = []
    for term in terms:
        _, mark, check = term.effect.explanation.partition("Check: ")
        if mark:
            checks.append(f"{term.effect.name}: {check}")
    return "What the machine itself can tell: " + " ".join(checks) if checks else ""
