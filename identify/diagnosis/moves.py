"""The moves of a search other than adding: taking out what does not hold, exchanging what only imitated, and going back."""

from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np

from identify.diagnosis.caution import load_siblings
from identify.diagnosis.deciding_constants import DROP_PER_PARAMETER, FOLDS
from identify.diagnosis.finding import Finding, gained
from identify.diagnosis.held_out import folds_of_motion, held_out_errors
from identify.diagnosis.pairs import Addition
from identify.diagnosis.refusals import Key, Refusals
from identify.diagnosis.screening import Screening
from identify.diagnosis.unseen_sessions import lowers_on_unseen, worse_on_unseen
from identify.effects.effect import DeclaredLoad
from identify.effects.model import Term
from identify.estimation import forked
from identify.estimation.fitted_model import FittedModel
from identify.estimation.fitting import fit_model, searched_anew
from identify.estimation.requested_model import known_effects

Added = list[tuple[Term, int]]
"""Terms that a search added, each with the joint that it is judged on."""
ROUNDING = 1e-9
"""Of an error: two fits of the same columns in another order differ by less."""


@dataclass(frozen=True)
class State:
    """Where a search stands.

    added    : what the model has beside the diagnosed one
    evidence : what each of these is worth beside the others
    listed   : of every joint all candidates beside the model
    chosen   : what is to be added
    """

    screening: Screening
    added: Added
    evidence: dict[Key, Finding]
    listed: list[list[Finding]]
    chosen: list[Addition]
    _costs: dict[bool, float] = field(default_factory=dict, repr=False)

    @classmethod
    def of(
        cls,
        screening: Screening,
        added: Added,
        evidence: dict[Key, Finding],
        refusals: Refusals,
        least: Sequence[float],
        known: list[list[Finding]] | None = None,
    ) -> "State":
        """Look at every candidate beside a model; `least` is for every joint the gain that an effect must have, `known` what
        was found where only the refusals have changed since."""
        listed, chosen = screening.selection.search(refusals.present(added), least, known)
        return cls(screening, added, evidence, listed, chosen)

    @property
    def present(self) -> FittedModel:
        """The model."""
        return self.screening.fitted

    def again(self, refusals: Refusals, least: Sequence[float]) -> "State":
        """The same without what was to be added: it led to nothing better."""
        for candidate, _ in self.chosen:
            refusals.refuse(candidate.term, candidate.judged, self.added)
        return State.of(self.screening, self.added, self.evidence, refusals, least, self.listed)

    def better_than(self, other: "State") -> bool:
        """Whether it makes motion that the fits did not see more probable, and by what each added effect must bring to have a
        name.

        Loads are taken as declared where an effect of either questions them: the payload ratio that is estimated beside
        all others does the work of such an effect, for nothing.
        """
        declared = any(
            term.effect.declared_load is DeclaredLoad.QUESTIONED for term, _ in (*self.added, *other.added)
        )
        return self._cost(declared) < other._cost(declared)

    def _cost(self, declared: bool) -> float:
        """Sum over the joints of the logarithm of the held-out squared error, and of what the least gain of each added effect
        takes from that: but for a factor and a constant the negative logarithm of the predictive density.

        declared : with the payloads as declared
        """
        if declared not in self._costs:
            selection = self.screening.selection
            errors = [
                selection.motion.alone(joint, selection.base(declared)).total
                for joint in range(self.present.record.joints)
            ]
            least = [1 - each.least_gain / max(each.before.total, 1e-300) for each in self.evidence.values()]
            self._costs[declared] = float(
                np.sum(np.log(np.maximum(errors, 1e-300))) - np.sum(np.log(np.maximum(least, 1e-300)))
            )
        return self._costs[declared]


@dataclass
class Fits:
    """The fits of a search: the diagnosed model with terms added, each set of terms fitted once.

    The columns of some effects follow the load and the torque of the fit before, so that a fit depends on where it starts. What a
    model is worth must not depend on what was added and taken out since it was fitted.
    """

    fitted: FittedModel
    _known: dict[frozenset[tuple[Key, int]], FittedModel] = field(default_factory=dict)

    def __call__(self, added: Added, start: FittedModel) -> tuple[FittedModel, Added]:
        """The diagnosed model with the added terms, their constants searched around what was found, from the load of `start`;
        and the terms with the constants of this fit."""
        model = self.fitted.model.with_terms(term for term, _ in added)
        present = self._known[_keys(added)] = fit_model(self.fitted.record, model, refine=True, start=start)
        return present, _settled(present, added)

    def without_others(self, added: Added, start: FittedModel) -> tuple[FittedModel, Added]:
        """The same for terms that are left of more, as they were fitted before there were more."""
        present = self._known.get(_keys(added))
        return self(added, start) if present is None else (present, _settled(present, added))

    def settled(self, present: FittedModel, added: Added) -> tuple[FittedModel, Added] | None:
        """The fit of a model at which a search ends, with the constants of all that it added searched together, from the
        beginning and around what is there, until none changes; None where that fits no better.

        A search chooses the constants of each effect beside those that were found before it. Beside all of them others may be
        right, of another kind too (a time since each session began, or since the first).
        """
        summaries = present.record.summaries
        if all(len(term.effect.grid(summaries[term.joint])) < 2 for term, _ in added):
            return None
        best, anew = present, searched_anew(present.record, present.model)
        while _settled(anew, added) != _settled(best, added):
            if anew.fit.relative_error >= best.fit.relative_error * (1 - ROUNDING):
                break
            best, anew = anew, fit_model(anew.record, anew.model, refine=True, start=anew)
        if best is present:
            return None
        self._known[_keys(added)] = best
        return best, _settled(best, added)


def _keys(added: Added) -> frozenset[tuple[Key, int]]:
    return frozenset((term.key, judged) for term, judged in added)


def _settled(present: FittedModel, added: Added) -> Added:
    constants = {term.key: term for term in present.model.terms}
    return [(constants[term.key], judged) for term, judged in added]


def verified(
    fits: Fits, present: FittedModel, added: Added, refusals: Refusals, least: Sequence[float]
) -> State:
    """Where a search stands with a model and its added terms, without those that are not justified beside all the others.

    What was taken out does not come back while these stay.
    """
    while True:
        screening = Screening.of(present, only_justified=True)
        kept = screening.beside_the_others(added, least)
        if len(kept) == len(added):
            evidence = {finding.candidate.key: finding for finding, _ in kept}
            return State.of(screening, added, evidence, refusals, least)
        staying = [(term, finding.candidate.judged) for finding, term in kept]
        keys = {term.key for term, _ in staying}
        for term, judged in added:
            if term.key not in keys:  # what only another joint justifies stays in the model
                refusals.refuse(term, judged, staying)
        added = [row for row in added if row in staying]
        present, added = fits.without_others(added, present)


def without_harmful(
    fits: Fits, present: FittedModel, added: Added, refusals: Refusals, harmful: set[Key]
) -> tuple[FittedModel, Added]:
    """The model and its added terms without those that raise the error on validation sessions, the most harmful first: of
    effects that stand for one another, or share what two joints share, the others may do good without it.

    A term is harmful where the model that is fitted without it, load and constants following, does better there.
    """
    while True:
        for term, judged in worse_on_unseen(present, added):
            rest = [row for row in added if row != (term, judged)]
            narrower, rest = fits.without_others(rest, present)
            if lowers_on_unseen(narrower, present, judged):
                refusals.refuse(term, judged, added)
                harmful.add(term.key)
                present, added = narrower, rest
                break
        else:
            return present, added


def exchanged(
    state: State,
    fits: Fits,
    refusals: Refusals,
    doubts: dict[Key, tuple[str, ...]],
    tried: set[tuple[Key, Key]],
) -> Added | None:
    """The added terms with one that imitated another effect exchanged for it; None where there is none.

    doubts : for an added effect those that explained the data alike when it was added; what is exchanged for one that
             only a change of load would tell from it stays its rival
    tried  : exchanges that the search made; none is made twice

    What was exchanged does not come back while what stands in its place stays.
    """
    screening, added = state.screening, state.added
    if len(added) < 2:
        return None
    replacements = forked.each(
        lambda row: screening.replacement(row[0], doubts.get((row[0].effect.name, row[1]), ())),
        added,
        known=[candidate.term.effect for candidate in screening.selection.candidates],
    )
    for place, ((term, judged), better) in enumerate(zip(added, replacements, strict=True)):
        if better is None or better[0].key in refusals.present(added) or (term.key, better[0].key) in tried:
            better = _better_refitted(state, fits, place, refusals, tried)
        if better is None:
            continue
        tried.add((term.key, better[0].key))
        refusals.refuse(term, judged, [*added, better])
        known, summary = (
            known_effects(screening.fitted.record.experiment),
            screening.fitted.record.summaries[judged],
        )
        siblings = load_siblings(better[0].effect, known, summary)
        doubts[better[0].effect.name, better[1]] = tuple({term.effect.name} & set(siblings))
        return [*added[:place], better, *added[place + 1 :]]
    return None


def _better_refitted(
    state: State, fits: Fits, place: int, refusals: Refusals, tried: set[tuple[Key, Key]]
) -> tuple[Term, int] | None:
    """An effect seen over the same variable as an added term, with no more parameters, that does better in its place by what a
    parameter must bring once the model is fitted with it; None where there is none.

    Others of that variable have constants that were chosen beside the term: a Stribeck velocity beside a cube of the speed bends
    so that the cube fits best. Only where there are such is the model fitted anew.
    """
    selection, present = state.screening.selection, state.present
    term, judged = state.added[place]
    rest = [row for row in state.added if row != (term, judged)]
    summary, variable = present.record.summaries[term.joint], term.effect.variable
    if not any(
        each.effect.variable == variable and joint == judged and len(each.effect.grid(summary)) > 1
        for each, joint in rest
    ):
        return None
    widest = len(term.effect.parameters_of(summary, dict(term.constants or ())))
    widest += len(term.constants or ())
    # the present constants follow once more, as those of a model with another effect do
    around, _ = fits(state.added, present)
    error = min(_held_out(each, judged) for each in (present, around))
    least = (1 - gained(DROP_PER_PARAMETER)) * error**2
    for finding in state.listed[judged]:
        candidate = finding.candidate
        if (
            candidate.term.effect.variable != variable
            or candidate.declared_load is not term.effect.declared_load
            or candidate.complexity(selection.observation, finding.variant) > widest
            or candidate.term.key in refusals.present(state.added)
            or (term.key, candidate.term.key) in tried
        ):
            continue
        tried.add((term.key, candidate.term.key))
        other = candidate.term.chosen(candidate.constants[finding.variant])
        wider, _ = fits([*rest, (other, judged)], present)
        if _held_out(wider, judged) ** 2 < least:
            return other, judged
    return None


def _held_out(fitted: FittedModel, joint: int) -> float:
    """Relative error of a joint on folds of motion that its fit did not see."""
    folds = folds_of_motion(fitted.observation, FOLDS)
    return held_out_errors(fitted.observation, fitted.fit.weights, folds)[joint]
