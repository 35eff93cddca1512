"""`improve`: diagnose and add, step by step, until nothing more is justified."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from identify.diagnosis.diagnosis import Diagnosis, diagnose_record
from identify.effects.model import Term
from identify.estimation.block_errors import block_errors
from identify.estimation.fitted_model import FittedModel
from identify.estimation.fitting import Progress, fit_model
from identify.estimation.requested_model import open_record, requested_model
from identify.estimation.small_algebra import single_threaded
from identify.recording import Experiment
from identify.results import improvement as documents
from identify.results.diagnosis import Verdict
from identify.results.document import Json
from identify.results.effect import EffectOnJoint
from identify.results.improvement import ImprovementDocument

MOST_STEPS = 24
"""Additions after which the story ends even if more would be justified."""


@dataclass(frozen=True)
class Step:
    """A model of the story: what was added, and its errors."""

    added: Term | None
    fitted: FittedModel
    relative_error: float
    relative_error_validation: float | None


@dataclass(frozen=True)
class Improvement:
    """The result of `improve`: the steps, the start being the first, and what the last diagnosis says.

    refused : effects (name, joint) that were missing but did not lower the error on the validation sessions
    """

    experiment: Experiment
    model: str
    steps: tuple[Step, ...]
    diagnosis: Diagnosis
    refused: frozenset[tuple[str, int]] = frozenset()

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
                )
                for step in self.steps
            ),
            verdict=self.verdict,
        )

    def to_json(self) -> Json:
        """The document as plain values."""
        return self.document().to_json()


@single_threaded
def improve(
    experiment: Experiment, model: str = "usual", add: Sequence[str] = (), progress: Progress | None = None
) -> Improvement:
    """Diagnose a model and add what is missing, one effect after the other, as long as each holds on the validation
    sessions (where there are some).

    Raises InputError: the experiment, the model or an effect is wrong.
    """
    record = open_record(experiment)
    present = requested_model(record, model, add)
    told = progress or (lambda fraction, words: None)
    steps = [_step(None, fit_model(record, present))]
    refused: set[tuple[str, int]] = set()
    least: tuple[float, ...] | None = None  # what counts as an effect stays what it was at the start
    while True:
        told(min(0.9, (len(steps) - 1) / MOST_STEPS), f"diagnosis after {len(steps) - 1} additions")
        last = steps[-1].fitted.model
        diagnosis = diagnose_record(record, model, last, without=frozenset(refused), least=least)
        least = diagnosis.least
        for term in diagnosis.added:
            grown = fit_model(record, steps[-1].fitted.model.with_terms([term]), refine=True)
            step = _step(term, grown)
            if _holds(steps[-1], step):
                steps.append(step)
            else:
                refused.add(term.key)
        if not diagnosis.added or len(steps) > MOST_STEPS:
            break
    told(1.0, "done")
    return Improvement(experiment, model, tuple(steps), diagnosis, frozenset(refused))


def _step(added: Term | None, fitted: FittedModel) -> Step:
    entries = fitted.record.entries("validation")
    checked = None
    if entries:
        errors = block_errors(fitted.observe(entries), fitted.fit.chi).sum(axis=(0, 1))
        checked = float(np.sqrt(errors[0] / errors[1])) if errors[1] > 0 else None
    return Step(added, fitted, fitted.fit.relative_error, checked)


def _holds(before: Step, after: Step) -> bool:
    """Whether an addition lowers the error, also where the fit did not see the motion."""
    if after.relative_error >= before.relative_error:
        return False
    if before.relative_error_validation is None or after.relative_error_validation is None:
        return True
    return after.relative_error_validation < before.relative_error_validation
