"""Screening of candidates: the residual of a fitted model, and every candidate's columns beside it."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property, partial

import numpy as np
from numpy.typing import NDArray

from identify.diagnosis.candidates import Candidate, find_candidates
from identify.diagnosis.closed_loop import loop_evidence
from identify.diagnosis.deciding_constants import DROP_PER_PARAMETER
from identify.diagnosis.finding import Finding, gained
from identify.diagnosis.free_functions import FREE_FUNCTIONS, FreeFunction
from identify.diagnosis.selection import Selection
from identify.diagnosis.turning import late_turns, possible_turns
from identify.effects.model import USUAL, Term
from identify.estimation.fitted_model import FittedModel
from identify.estimation.informed_summary import informed_summaries, joint_predictions
from identify.estimation.observation import Slot, observe
from identify.estimation.prediction import Prediction
from identify.estimation.requested_model import known_effects
from identify.estimation.reversal_noise import ReversalNoise
from identify.results.diagnosis import NotApplicable

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Screening:
    """What one pass over the samples gives the search.

    predictions : for every joint those of the sessions of the fit
    left_out    : effects that the record cannot show, with the reason
    """

    fitted: FittedModel
    predictions: list[list[Prediction]]
    selection: Selection
    left_out: list[NotApplicable]

    @classmethod
    def of(cls, fitted: FittedModel, only_justified: bool = False) -> "Screening":
        """Compute the columns of every candidate beside a fitted model.

        only_justified : whether nobody asks for the evidence of candidates that are not justified whatever it is
        """
        record = fitted.record
        predictions = joint_predictions(fitted)
        summaries = informed_summaries(fitted)
        first = len(fitted.slots)
        known = known_effects(record.experiment)
        candidates, left_out = find_candidates(record, fitted.model, known, summaries, first)
        tried = [slot for candidate in candidates for slot in candidate.slots()]
        slots = [*fitted.slots, *tried, *late_turns(record.joints)]
        noise = reversal_noise(fitted, predictions)
        observation = observe(record, fitted.entries, slots, fitted.torque, noise, by_joint=True)
        model_slots = list(range(first - 1 if fitted.estimates_payload_ratio else first))
        nothing = np.zeros(0, np.intp)
        model = np.concatenate(
            [np.arange(observation.base), *(observation.slot_columns[i] for i in model_slots)]
        ).astype(np.intp)
        turns = observation.slot_columns[first + len(tried) :]
        selection = Selection(
            observation,
            fitted.fit.weights,
            candidates,
            model,
            observation.slot_columns[first - 1] if fitted.estimates_payload_ratio else nothing,
            partial(loop_evidence, fitted, noise),
            only_justified,
            possible_turns(fitted, observation, model, turns),
        )
        return cls(fitted, predictions, selection, left_out)

    @cached_property
    def _free(self) -> tuple[Selection, list[dict[str, NDArray[np.intp]]]]:
        """Beside the fitted model a free function of each variable of every joint, and the columns of each.

        In a pass of their own: they are a third of all columns, and asked for at the beginning and the end of a search only.
        """
        record, selection = self.fitted.record, self.selection
        model = len(self.fitted.slots)
        free = [
            Slot.of(Term(function, summary.joint), function.grid(summary)[0])
            for summary in informed_summaries(self.fitted)
            for function in FREE_FUNCTIONS
        ]
        noise = reversal_noise(self.fitted, self.predictions)
        slots = [*self.fitted.slots, *free]
        observation = observe(record, self.fitted.entries, slots, self.fitted.torque, noise, by_joint=True)
        functions: list[dict[str, NDArray[np.intp]]] = [{} for _ in range(record.joints)]
        for slot, columns in zip(free, observation.slot_columns[model:], strict=True):
            functions[slot.term.joint][slot.term.effect.name] = columns
        return selection.on(observation), functions

    def best_free_function(self, joint: int) -> FreeFunction:
        """The free function of one variable that leaves the least held-out error of a joint."""
        selection, functions = self._free
        without = selection.held_out_error(joint)
        listed = [
            FreeFunction(name, selection.held_out_error(joint, columns), without, len(columns))
            for name, columns in functions[joint].items()
        ]
        return min(listed, key=lambda function: function.error)

    def doubted(self, joint: int, missing: Sequence[Term]) -> str | None:
        """The variable over which a free function explains what missing effects of a fixed shape do not; None where there
        is none.

        An effect without constants has one shape. If it is the cause, nothing is left over its variable.
        """
        of_one_shape = {
            term.effect.variable
            for term in missing
            if not term.constants and len(term.effect.parameters) == 1
        }
        for variable in (function.name for function in FREE_FUNCTIONS if function.name in of_one_shape):
            selection, functions = self._free
            if selection.explains(joint, functions[joint][variable]):
                return variable
        return None

    def least(self, joint: int) -> float:
        """The gain in squared held-out error that an effect must have to be any operator's business.

        A part of what the usual model leaves, whatever model is looked at: so that what one search leaves alone, another
        that starts where it ended does too.
        """
        observation = self.selection.observation
        usual = [
            columns
            for slot, columns in zip(observation.slots, observation.slot_columns, strict=True)
            if slot.term.effect.name in USUAL and (slot.term.joint == joint or slot in self.fitted.slots)
        ]
        return gained(DROP_PER_PARAMETER) * self.selection.reference(
            joint, np.concatenate([*usual, np.arange(0)]).astype(np.intp)
        )

    def beside_the_others(
        self, added: Sequence[tuple[Term, int]], least: Sequence[float]
    ) -> list[tuple[Finding, Term]]:
        """What each term that a search added is worth beside all the others; without those that are not justified."""
        record = self.fitted.record
        places = {slot.term.key: index for index, slot in enumerate(self.fitted.slots)}
        listed = []
        for term, judged in added:
            summary = record.summaries[term.joint]
            constants = (self.fitted.slots[places[term.key]].values,)
            searched = term.effect.searched(summary)
            listed.append((Candidate(term, judged, constants, places[term.key], searched, summary), term))
        findings = self.selection.beside_the_others([candidate for candidate, _ in listed], least)
        terms = {id(candidate): term for candidate, term in listed}
        return [(finding, terms[id(finding.candidate)]) for finding in findings]

    def with_evidence(self, joint: int, findings: Sequence[Finding], least: float) -> list[Finding]:
        """The findings of a joint, those that may gain enough with the evidence that the search did not ask for.

        least : the gain that an effect must have
        """
        selection = self.selection
        if not selection.only_justified:
            return list(findings)
        answered = []
        for finding in findings:
            candidate = finding.candidate
            if not finding.justified and 2 * finding.gain >= max(least, finding.least_gain):
                base = selection.base(declared=not candidate.beside_ratio)
                p_value, _ = selection.possible_evidence(joint, base, candidate, finding.variant)
                corrected = min(1.0, p_value * candidate.searched * selection.tried(joint))
                finding = replace(finding, p_value=corrected)
            answered.append(finding)
        return answered

    def worth(self, term: Term) -> float:
        """Part of the held-out error that a term of the model takes away."""
        for slot, columns in zip(self.fitted.slots, self.selection.observation.slot_columns, strict=False):
            if slot.term.key == term.key:
                joint = self.judged_on(term)
                base = np.setdiff1d(self.selection.base(), columns)
                return self.selection.worth(joint, base, columns)
        return 0.0

    def replacement(self, term: Term, rivals: Sequence[str]) -> tuple[Term, int] | None:
        """An effect that does better in the place of a term of the model, and its joint.

        rivals : effects that explained the data alike when the term was added
        """
        for slot, columns in zip(self.fitted.slots, self.selection.observation.slot_columns, strict=False):
            if slot.term.key == term.key:
                joint = self.judged_on(term)
                complexity = len(columns) + len(term.constants or ())
                better = self.selection.replacement(joint, columns, complexity)
                better = better or self.selection.decided_since(joint, columns, complexity, rivals)
                if better is not None:
                    candidate, variant = better
                    return candidate.term.chosen(candidate.constants[variant]), joint
        return None

    def judged_on(self, term: Term) -> int:
        """The joint that carries the largest part of a term's columns."""
        observation = self.selection.observation
        for slot, columns in zip(self.fitted.slots, observation.slot_columns, strict=False):
            if slot.term.key == term.key:
                carried = [np.isin(columns, of_joint).sum() for of_joint in observation.joint_columns]
                return term.joint if carried[term.joint] else int(np.argmax(carried))
        return term.joint

    def superfluous(self, joint: int) -> tuple[str, ...]:
        """Terms of the model on a joint whose columns do not lower its held-out error."""
        named = [
            term.effect.name
            for term in self.fitted.model.terms
            if term.joint == joint and term.effect.rows in ("joint", "gear") and self.worth(term) <= 0
        ]
        return tuple(named)


def reversal_noise(fitted: FittedModel, predictions: Sequence[Sequence[Prediction]]) -> ReversalNoise:
    """What the fitted model says of the residual away from reversals."""
    deviation = [
        1.4826 * float(np.median(np.abs(np.concatenate([part.residual[part.moving] for part in parts]))))
        for parts in predictions
    ]
    return ReversalNoise(np.array(deviation), fitted.record.speed_resolution)
