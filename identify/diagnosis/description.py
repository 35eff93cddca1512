"""What no catalogue knows, described: where structure is left, or a straight effect imitates what acts on one side only.

A description is offered where a torque over one variable, of either sense of motion, passes every test that an effect of
the catalogue passes, and what it leaves is not called unexplained any more. All are compared on motion that the fit did not
see; the fewest support points and the shortest form that do as well are taken. It is offered, never added.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from identify.diagnosis.candidates import Candidate
from identify.diagnosis.closed_loop import LoopEvidence
from identify.diagnosis.deciding_constants import DROP_PER_PARAMETER, LEAST_DROP, NEARLY_ALL, SIGNIFICANCE
from identify.diagnosis.evidence import group_evidence
from identify.diagnosis.finding import Finding, gained
from identify.diagnosis.joint_diagnosis import JointDiagnosis
from identify.diagnosis.learned_document import learned_document
from identify.diagnosis.screening import reversal_noise
from identify.diagnosis.selection import Selection
from identify.diagnosis.structure import bounded, leftover_structure
from identify.diagnosis.unseen_sessions import worse_on_unseen
from identify.diagnosis.verdict import verdict
from identify.effects.learned_forms import (
    Description,
    LearnedVariable,
    Sense,
    closed_forms,
    searched_finer,
    tables,
    variables_of,
)
from identify.effects.model import Term
from identify.effects.motion import JointSummary
from identify.estimation.fitted_model import FittedModel
from identify.estimation.fitting import fit_model
from identify.estimation.informed_summary import informed_summaries, joint_predictions
from identify.estimation.observation import Observation, Slot, observe
from identify.estimation.prediction import mean_error
from identify.estimation.requested_model import known_effects
from identify.estimation.reversal_noise import ReversalNoise
from identify.results.diagnosis import Learned

Index = NDArray[np.intp]
Keys = frozenset[tuple[str, int]]


@dataclass(frozen=True)
class Offered:
    """A description that holds.

    replaces : missing effects (name, joint) that explain nothing beside it
    """

    document: Learned
    replaces: Keys


@dataclass(frozen=True)
class _Found:
    """A description, how it fares, the effects that it is judged without, and where its columns stand."""

    description: Description
    finding: Finding
    without: Keys
    tried: "_Tried"

    @property
    def columns(self) -> Index:
        """Its columns, constants chosen."""
        return self.finding.candidate.columns(self.tried.observation, self.finding.variant)


@dataclass(frozen=True)
class _Tried:
    """Descriptions of a joint with their columns beside those of the model."""

    present: FittedModel
    observation: Observation
    described: dict[int, Description]
    """by the first slot of each"""
    candidates: tuple[Candidate, ...]

    @classmethod
    def of(
        cls,
        present: FittedModel,
        noise: ReversalNoise,
        summary: JointSummary,
        listed: Sequence[Description],
    ) -> "_Tried":
        """One pass over the samples."""
        candidates, described, first = [], {}, len(present.slots)
        for each in listed:
            constants = tuple(each.effect.grid(summary))
            candidates.append(
                Candidate(
                    Term(each.effect, summary.joint),
                    summary.joint,
                    constants,
                    first,
                    each.effect.searched(summary),
                    summary,
                )
            )
            described[first] = each
            first += len(constants)
        slots: list[Slot] = [*present.slots, *(slot for each in candidates for slot in each.slots())]
        observation = observe(present.record, present.entries, slots, present.torque, noise)
        return cls(present, observation, described, tuple(candidates))

    def base(self, without: Keys) -> Index:
        """Columns of the model, some of its terms and the payload ratio left out."""
        slots = self.present.slots[:-1] if self.present.estimates_payload_ratio else self.present.slots
        kept = [
            columns
            for slot, columns in zip(slots, self.observation.slot_columns, strict=False)
            if slot.term.key not in without
        ]
        return np.concatenate([np.arange(self.observation.base), *kept]).astype(np.intp)

    def columns_of(self, keys: Keys) -> Index:
        """Columns of some terms of the model."""
        chosen = [
            columns
            for slot, columns in zip(self.present.slots, self.observation.slot_columns, strict=False)
            if slot.term.key in keys
        ]
        return np.concatenate([np.zeros(0, np.intp), *chosen]).astype(np.intp)

    @property
    def ratio(self) -> Index:
        """Columns of the payload ratio; none where it is not estimated."""
        if not self.present.estimates_payload_ratio:
            return np.zeros(0, np.intp)
        return self.observation.slot_columns[len(self.present.slots) - 1]

    @cached_property
    def _judge(self) -> Selection:
        """The diagnosis' own judge; its products are those of the observation, whatever is judged."""
        nothing = frozenset[tuple[str, int]]()
        return Selection(
            self.observation,
            self.present.fit.weights,
            (),
            self.base(nothing),
            self.ratio,
            _no_instruments,
            only_justified=True,
        )

    def selection(self, candidates: Sequence[Candidate], without: Keys) -> Selection:
        """The judge over some candidates, beside the model without some of its terms."""
        return self._judge.beside(self.base(without), candidates)

    def best(self, variable: str | None, without: Keys, forms: bool = False) -> _Found | None:
        """The best justified description; over one variable, or over any; of the closed forms only if so asked."""
        described = [(each, self.described[each.first]) for each in self.candidates]
        listed = [
            each
            for each, description in described
            if (variable is None or description.variable.name == variable)
            and not (forms and description.form is None)
        ]
        joint = self.candidates[0].judged
        findings = self.selection(listed, without).findings(joint)
        finding = next((each for each in findings if each.justified), None)
        if finding is None:
            return None
        return _Found(self.described[finding.candidate.first], finding, without, self)

    def p_value(self, joint: int, beside: Index, columns: Index) -> float:
        """Probability that some columns explain nothing beside others."""
        extra = np.setdiff1d(columns, beside)
        return group_evidence(self.observation, joint, beside, extra).p_value


def _no_instruments(joint: int, asked: Sequence[tuple[Candidate, int]]) -> list[LoopEvidence]:
    """Descriptions are no derivatives of the motion, so that nobody asks."""
    return []


def _as_low(finding: Finding, other: Finding) -> bool:
    """Whether the error with one description is at most that with another, but for what a parameter must bring."""
    allowed = gained(DROP_PER_PARAMETER) * other.before.total
    return finding.after.total <= other.after.total + allowed


@dataclass(frozen=True)
class Describer:
    """The search for descriptions of what a model with the missing effects leaves.

    present   : the diagnosed model and every effect that the search added
    diagnosed : terms of the diagnosed model
    """

    present: FittedModel
    summaries: list[JointSummary]
    noise: ReversalNoise
    diagnosed: Keys

    @classmethod
    def of(cls, present: FittedModel, diagnosed: FittedModel) -> "Describer":
        """From the model with the missing effects and the one without."""
        predictions = joint_predictions(present)
        return cls(
            present,
            informed_summaries(present),
            reversal_noise(present, predictions),
            frozenset(term.key for term in diagnosed.model.terms),
        )

    def offer(self, joint: int, said: JointDiagnosis) -> Offered | None:
        """A description of what a joint's model leaves; None where none holds.

        Where the verdict is `missing`, one over the variable in doubt that acts on one side only and stands in the place of
        effects of which it leaves nothing.
        """
        summary = self.summaries[joint]
        doubted = said.doubted if said.verdict == "missing" else None
        variables = [
            each
            for each in variables_of(summary, self.summaries, known_effects(self.present.record.experiment))
            if doubted is None or each.name == doubted
        ]
        missing = {term.key for term in said.missing}
        imitators = frozenset(
            term.key
            for term in self.present.model.terms
            if term.joint == joint and term.key not in self.diagnosed and term.key not in missing
        )
        listed = [table for each in variables for table in tables(each, summary)]
        if not listed:
            return None
        tried = self._tried(summary, listed)
        table = self._best(tried, said, imitators, replacing=bool(doubted))
        # a narrow shape may be in no table; it is looked for over the position
        senses: tuple[Sense, ...] = ("plain", "turned")
        over: list[tuple[LearnedVariable, Sense]] = [
            (each, sense) for each in variables[:1] for sense in senses
        ]
        if table is not None:
            over = [(table.description.variable, table.description.sense)]
        forms = [form for variable, sense in over for form in closed_forms(variable, sense, summary)]
        if doubted:
            forms = [each for each in forms if each.form is not None and each.form.one_sided]
        form = None
        if forms:
            beside = [*forms, *([table.description] if table else [])]
            form = self._as_good_form(self._tried(summary, beside), said, imitators, table, bool(doubted))
            if doubted and form is not None and not self._better_than_effects(form, imitators):
                form = None
        if form is None and (table is None or doubted):
            return None
        return self._holding(joint, said, table, form)

    def _tried(self, summary: JointSummary, listed: Sequence[Description]) -> _Tried:
        return _Tried.of(self.present, self.noise, summary, listed)

    def _best(
        self, tried: _Tried, said: JointDiagnosis, imitators: Keys, replacing: bool, forms: bool = False
    ) -> _Found | None:
        """The best description, without the missing effects of its own variable where it does as well so."""
        beside = None if replacing else tried.best(None, imitators, forms)
        best = beside
        for variable in {term.effect.variable for term in said.missing}:
            rivals = frozenset(term.key for term in said.missing if term.effect.variable == variable)
            instead = tried.best(variable, imitators | rivals, forms)
            if (
                instead is None
                or tried.p_value(
                    instead.finding.candidate.judged,
                    np.union1d(tried.base(instead.without), instead.columns),
                    tried.columns_of(rivals),
                )
                < SIGNIFICANCE
            ):
                continue
            if best is None or _as_low(instead.finding, best.finding):
                best = instead
        return best

    def _as_good_form(
        self, tried: _Tried, said: JointDiagnosis, imitators: Keys, table: _Found | None, replacing: bool
    ) -> _Found | None:
        """The best closed form; where there is a table and it is to replace no effect, if it does as well as the table."""
        if table is None:
            return self._best(tried, said, imitators, replacing, forms=True)
        joint = table.finding.candidate.judged
        form = tried.best(None, table.without, forms=True)
        if form is None or replacing:
            return form
        as_low = _as_low(form.finding, table.finding)
        columns = tried.candidates[-1].columns(tried.observation, 0)
        beside = np.union1d(tried.base(table.without), form.columns)
        nearly = form.finding.gain >= NEARLY_ALL * table.finding.gain
        return form if as_low or (nearly and tried.p_value(joint, beside, columns) > SIGNIFICANCE) else None

    def _better_than_effects(self, form: _Found, imitators: Keys) -> bool:
        """Whether a form that is to stand in the place of effects, which explain nothing beside it, does clearly better than
        they, and explains what they do not: of two that each do without the other the known one is the cause."""
        finding, tried = form.finding, form.tried
        joint, with_them = finding.candidate.judged, tried.selection((), imitators)
        before = with_them.motion.alone(joint, with_them.base()).total
        p_value = tried.p_value(joint, with_them.base(), form.columns)
        searched = finding.candidate.searched * len(tried.candidates)
        return finding.after.total < (1 - 2 * LEAST_DROP) * before and p_value * searched < SIGNIFICANCE

    def _holding(
        self, joint: int, said: JointDiagnosis, table: _Found | None, form: _Found | None
    ) -> Offered | None:
        """The description fitted with the model; None where what it leaves is still unexplained, or where the error of the
        fit or of a validation session rises."""
        best = form or table
        assert best is not None  # one of them was found
        description, finding = best.description, best.finding
        description = searched_finer(description, finding.candidate.constants[finding.variant])
        term = Term(description.effect, joint)
        replaced = best.without & {each.key for each in said.missing}
        before = self._fitted_without(best.without - replaced)
        narrower = self._fitted_without(best.without)
        after = fit_model(self.present.record, narrower.model.with_terms([term]))
        if after.fit.residual[joint] >= before.fit.residual[joint]:
            return None
        term = next(each for each in after.model.terms if each.key == term.key)
        if worse_on_unseen(after, [(term, joint)]):
            return None
        left = joint_predictions(after)[joint]
        start = mean_error(joint_predictions(before)[joint])
        outcome = verdict(
            start, mean_error(bounded(left)), said.noise_floor, leftover_structure(left), missing=True
        )
        if outcome == "unexplained":
            return None
        return Offered(learned_document(after, term, description, finding), replaced)

    def _fitted_without(self, keys: Keys) -> FittedModel:
        """The model without some of its terms."""
        if not keys:
            return self.present
        model = self.present.model
        for key in keys:
            model = model.without(key)
        return fit_model(self.present.record, model)
