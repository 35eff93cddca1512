"""`improve`: diagnose and add, step by step, until nothing more is justified."""

from collections.abc import Sequence
from dataclasses import dataclass, replace

from identify.diagnosis.diagnosis import Diagnosis, diagnose_record, with_descriptions
from identify.diagnosis.motion_judgement import motion_of_story
from identify.diagnosis.story import Step, exchanged, step_of, widened
from identify.effects.model import Model, model_name
from identify.estimation.fitting import Progress, fit_model
from identify.estimation.forked import side_by_side
from identify.estimation.record import Record
from identify.estimation.requested_model import open_record, requested_model
from identify.estimation.small_algebra import single_threaded
from identify.recording import Experiment
from identify.results import improvement as documents
from identify.results.diagnosis import Verdict
from identify.results.document import Json
from identify.results.effect import EffectOnJoint
from identify.results.improvement import ImprovementDocument
from identify.results.unseen_motion import UnseenMotionErrors

MOST_STEPS = 24
"""Additions after which the story ends even if more would be justified."""


@dataclass(frozen=True)
class Improvement:
    """The result of `improve`: the steps, the start being the first, and what the last diagnosis says.

    refused : effects (name, joint) that were missing but raised an error of their joint when they were added
    """

    experiment: Experiment
    model: str
    steps: tuple[Step, ...]
    diagnosis: Diagnosis
    refused: frozenset[tuple[str, int]] = frozenset()
    motion: tuple[UnseenMotionErrors | None, ...] | None = None
    """of each step, compared with the one before; None where it was not asked for"""

    @property
    def verdict(self) -> Verdict:
        """The worst verdict over the joints at the end; `unexplained` where an effect that is missing did not hold."""
        verdicts: set[Verdict] = {joint.verdict for joint in self.diagnosis.joints}
        if self.refused:
            verdicts.add("unexplained")
        order: tuple[Verdict, ...] = ("missing", "unexplained", "adequate")
        return next(word for word in order if word in verdicts)

    def document(self) -> ImprovementDocument:
        """The contract's `improve --json`, section 3."""
        names = self.steps[0].fitted.record.joint_names
        return ImprovementDocument(
            experiment=self.experiment.name,
            model=self.model,
            steps=tuple(
                documents.Step(
                    added=None
                    if step.added is None
                    else EffectOnJoint(effect=step.added.effect.name, joint=names[step.added.joint]),
                    relative_error=step.relative_error,
                    relative_error_validation=step.relative_error_validation,
                    joints=tuple(
                        documents.StepJoint(
                            joint=name,
                            relative_error=errors.fit,
                            relative_error_validation=errors.validation,
                            heldout_error=errors.held_out,
                        )
                        for name, errors in zip(names, step.joints, strict=True)
                    ),
                    motion=motion,
                )
                for step, motion in zip(self.steps, self.motion or [None] * len(self.steps), strict=True)
            ),
            verdict=self.verdict,
            learned={
                joint.joint: joint.learned for joint in self.diagnosis.joints if joint.learned is not None
            },
        )

    def to_json(self) -> Json:
        """The document as plain values."""
        return self.document().to_json()


@single_threaded
def improve(
    experiment: Experiment,
    model: str = "usual",
    add: Sequence[str] = (),
    progress: Progress | None = None,
    motion: bool = False,
) -> Improvement:
    """Diagnose a model and add what is missing, one effect after the other, as long as none raises the error of its own
    joint: in the fit, on motion that the fit did not see, or on the validation sessions.

    motion : also say how well each step predicts motion that its fit did not see
    Raises InputError: the experiment, the model or an effect is wrong.
    """
    model = model_name(model)
    record = open_record(experiment, model)
    present = requested_model(record, model, add)
    report = progress or (lambda fraction, step: None)
    with side_by_side(record.joints):
        improved = _improve(record, model, present, report)
    if motion:
        report(0.9, "predicting motion that the fits did not see")
        judged = tuple(motion_of_story([step.fitted for step in improved.steps]))
        improved = replace(improved, motion=judged)
    report(1.0, "done")
    return improved


def _improve(record: Record, name: str, present: Model, report: Progress) -> Improvement:
    steps = [step_of(None, fit_model(record, present))]
    refused: set[tuple[str, int]] = set()
    while True:
        report(min(0.9, (len(steps) - 1) / MOST_STEPS), f"diagnosis after {len(steps) - 1} additions")
        last = steps[-1].fitted.model
        diagnosis = diagnose_record(record, name, last, without=frozenset(refused))
        diagnosis = with_descriptions(diagnosis, of_doubted_only=True)
        # an effect of a motor that two joints share is found on both, and is one
        waiting = [term for term in diagnosis.added if not last.has(*term.key)]
        waiting = list({term.key: term for term in waiting}.values())
        while waiting:
            later = []
            for term in waiting:
                step = step_of(term, widened(steps[-1].fitted, term))
                if step.holds_after(steps[-1]):
                    steps.append(step)
                else:
                    later.append(term)  # it may only help beside another one
            if len(later) == len(waiting):
                break
            waiting = later
        refused |= {term.key for term in waiting}
        if not diagnosis.added or len(steps) > MOST_STEPS:
            better = exchanged(steps, frozenset(refused)) if len(steps) <= MOST_STEPS else None
            if better is None:
                break
            gone = {step.added for step in steps} - {step.added for step in better}
            refused |= {term.key for term in gone if term is not None}
            steps = better
    diagnosis = with_descriptions(diagnosis)
    return Improvement(record.experiment, name, tuple(steps), diagnosis, frozenset(refused))
