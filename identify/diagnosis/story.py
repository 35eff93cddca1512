"""The steps of an improvement: what each adds, what it costs and gains, and what could stand in its place."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np

from identify.diagnosis.deciding_constants import DROP_PER_PARAMETER, FOLDS
from identify.diagnosis.held_out import folds_of_motion, held_out_errors
from identify.diagnosis.moves import ROUNDING
from identify.effects.model import Term, terms_of
from identify.estimation import forked
from identify.estimation.block_errors import block_errors
from identify.estimation.fitted_model import FittedModel
from identify.estimation.fitting import fit_model, searched_anew
from identify.estimation.requested_model import known_effects
from identify.validation.relative_error import ratio


@dataclass(frozen=True)
class JointErrors:
    """Relative errors of one joint: on the sessions of the fit, on the validation sessions, on motion that the fit did
    not see (folds of its sessions), and on all motion that it did not see, validation sessions and folds together."""

    fit: float
    validation: float | None
    held_out: float
    unseen: float

    def no_worse_than(self, other: "JointErrors", slack: float = 1.0) -> bool:
        """Whether none of the errors is higher than another's, or than `slack` times it."""
        checked = (
            self.validation is None or other.validation is None or self.validation <= slack * other.validation
        )
        return self.fit <= slack * other.fit and self.held_out <= slack * other.held_out and checked


@dataclass(frozen=True)
class Step:
    """A model of the story: what was added, and its errors, of all joints and of each."""

    added: Term | None
    fitted: FittedModel
    relative_error: float
    relative_error_validation: float | None
    joints: tuple[JointErrors, ...]

    def holds_after(self, before: "Step") -> bool:
        """Whether the addition lowers the error, also on the validation sessions, and raises none of its own joint's.

        An addition that says of the loads what the payload ratio beside the model said (eq. 35: wrong masses, a wrong gain)
        takes the ratio's place, and leaves the fit as it was. It must lower the errors of the loads as declared, and where it
        says so with fewer parameters, the ratios may do better by no more than what those parameters would have to bring.
        """
        assert self.added is not None  # every step but the first adds
        joint = self.added.joint
        if before.fitted.estimates_payload_ratio and not self.fitted.estimates_payload_ratio:
            declared = as_declared(before)
            spared = max(before.fitted.observation.width - self.fitted.observation.width, 0)
            slack = 1 + max(DROP_PER_PARAMETER * spared, ROUNDING)
            holds = self.joints[joint].no_worse_than(before.joints[joint], slack)
            return (
                holds and self.joints[joint].no_worse_than(declared.joints[joint]) and self.lowers(declared)
            )
        return self.joints[joint].no_worse_than(before.joints[joint]) and self.lowers(before)

    def lowers(self, other: "Step") -> bool:
        """Whether the error of all joints is lower than that of another model, also on the validation sessions."""
        if self.relative_error_validation is not None and other.relative_error_validation is not None:
            return (
                self.relative_error < other.relative_error
                and self.relative_error_validation < other.relative_error_validation
            )
        return self.relative_error < other.relative_error


def step_of(added: Term | None, fitted: FittedModel) -> Step:
    """A step with the errors of its model."""
    entries = fitted.record.entries("validation")
    count = fitted.record.joints
    errors = np.zeros((count, 2))
    if entries:
        errors = block_errors(fitted.observe(entries), fitted.fit.chi).sum(axis=0)
    observation, fit = fitted.observation, fitted.fit
    held_out = held_out_errors(observation, fit.weights, folds_of_motion(observation, FOLDS))
    power = np.where(fit.norm > 0, fit.norm, 1.0)
    joints = tuple(
        JointErrors(
            float(fit.residual[joint] / power[joint]),
            ratio(*errors[joint]),
            held_out[joint],
            float(
                np.sqrt(
                    ((held_out[joint] * power[joint]) ** 2 + errors[joint, 0])
                    / (power[joint] ** 2 + errors[joint, 1])
                )
            ),
        )
        for joint in range(count)
    )
    return Step(added, fitted, fit.relative_error, ratio(*errors.sum(axis=0)), joints)


def as_declared(step: Step) -> Step:
    """The same model with the loads as declared, without the payload ratio of eq. (35) beside it."""
    fitted = step.fitted
    return step_of(
        step.added, fit_model(fitted.record, fitted.model, fitted.entries, payload_ratio=False, start=fitted)
    )


def widened(fitted: FittedModel, term: Term) -> FittedModel:
    """The model with one term more: its constants searched from where the model stands, or all of them from the beginning,
    whichever fits better.

    From where it stands it never fits worse; from the beginning it may leave a choice of constants that suited the
    narrower model.
    """
    wider = fitted.model.with_terms([term])
    tried = [
        fit_model(fitted.record, wider, refine=True, start=fitted),
        fit_model(fitted.record, wider, refine=True),
        searched_anew(fitted.record, wider),
    ]
    return min(tried, key=lambda model: model.fit.relative_error)


def exchanged(steps: Sequence[Step], refused: frozenset[tuple[str, int]]) -> list[Step] | None:
    """The story with one addition exchanged for an effect seen over the same variable, where all that the fit did not see
    says so; None where there is no such exchange.

    The folds of one short session may favour what imitates an effect in a single stretch of it. An exchange lowers the
    error of its joint in the fit and on all unseen motion together, that of all joints in the fit and on the validation
    sessions, and its story holds step by step as any other does.

    refused : effects (name, joint) that are not to be added
    """
    last = steps[-1]
    added = [step.added for step in steps if step.added is not None]
    asked = [
        (place, term, other)
        for place, term in enumerate(added, 1)
        for other in _alternatives(last, term, refused)
    ]

    def unseen_if_better(asked: tuple[int, Term, Term]) -> float | None:
        _, term, other = asked
        model = last.fitted.model.without(term.key).with_terms([other])
        step = step_of(other, searched_anew(last.fitted.record, model))
        after, before = step.joints[term.joint], last.joints[term.joint]
        better = after.fit <= before.fit and after.unseen < before.unseen and step.lowers(last)
        return after.unseen if better else None

    errors = forked.each(unseen_if_better, asked)
    better = [
        (place, unseen, other)
        for (place, _, other), unseen in zip(asked, errors, strict=True)
        if unseen is not None
    ]
    for place, _, other in sorted(better, key=lambda row: row[:2]):
        story = _retold(steps, place, other)
        if story is not None:
            return story
    return None


def _alternatives(step: Step, term: Term, refused: frozenset[tuple[str, int]]) -> Iterator[Term]:
    """Effects that are seen over the same variable as a term, on its joint, with no more parameters, and not in the model."""
    record, model = step.fitted.record, step.fitted.model
    summary = record.summaries[term.joint]
    width = len(term.effect.parameters_of(summary, dict(term.constants or ())))
    for effect in known_effects(record.experiment).values():
        key = (effect.name, term.joint)
        if effect.variable != term.effect.variable or effect.rows != term.effect.rows or effect.from_residual:
            continue
        if key in refused or model.has(*key) or effect.prevented(summary):
            continue
        if all(len(effect.parameters_of(summary, constants)) <= width for constants in effect.grid(summary)):
            yield from terms_of(effect, [term.joint], record.experiment.drive_gain)


def _retold(steps: Sequence[Step], place: int, other: Term) -> list[Step] | None:
    """The story with another addition at a place; None where one of its steps does not hold then."""
    story = list(steps[:place])
    for step in [other, *(step.added for step in steps[place + 1 :])]:
        assert step is not None  # every step but the first adds
        following = step_of(step, widened(story[-1].fitted, step))
        if not following.holds_after(story[-1]):
            return None
        story.append(following)
    return story
