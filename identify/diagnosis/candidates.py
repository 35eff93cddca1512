"""The candidates: every effect of the catalogue that a joint's model does not have and the record could show."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from identify.diagnosis.held_out import Trial
from identify.effects.admissible import Admissible, named_parameters, own_values
from identify.effects.effect import DeclaredLoad, Effect
from identify.effects.model import Model, Term, terms_of
from identify.effects.motion import JointSummary
from identify.estimation.observation import Observation, Slot, rows_of
from identify.estimation.record import Record
from identify.results.diagnosis import NotApplicable

Array = NDArray[np.float64]
Index = NDArray[np.intp]


@dataclass(frozen=True)
class Candidate:
    """An effect on one joint with all choices of its constants.

    judged : the joint on whose rows it is judged
    first  : index of its first slot in the observation
    """

    term: Term
    judged: int
    constants: tuple[dict[str, float], ...]
    first: int
    searched: int
    summary: JointSummary

    @property
    def name(self) -> str:
        """Name of the effect."""
        return self.term.effect.name

    @property
    def declared_load(self) -> DeclaredLoad:
        """How it treats the declared loads."""
        return self.term.effect.declared_load

    @property
    def from_derivatives(self) -> bool:
        """Whether it lives in derivatives of the motion."""
        return self.term.effect.from_derivatives

    @property
    def beside_ratio(self) -> bool:
        """Whether it is judged beside a payload ratio that is estimated with it (eq. 35)."""
        return self.declared_load is DeclaredLoad.CORRECTED

    @property
    def key(self) -> tuple[str, int]:
        """Effect and joint that it is judged on."""
        return self.name, self.judged

    def slots(self) -> list[Slot]:
        """One slot for every choice of the constants."""
        return [Slot.of(self.term, constants) for constants in self.constants]

    def trial(self, observation: Observation) -> Trial:
        """Its columns, for every choice of the constants."""
        indices = range(self.first, self.first + len(self.constants))
        variants = tuple(observation.slot_columns[index] for index in indices)
        return Trial(variants, tuple(self.bounds(len(columns), i) for i, columns in enumerate(variants)))

    def bounds(self, count: int, variant: int) -> Admissible:
        """What the parameters of one choice's columns can be."""
        return own_values(self.term, self.constants[variant], count, self.summary)

    def parameters(self, count: int, variant: int) -> list[tuple[str, str]]:
        """Name, with the joint's number, and unit of each of its columns' parameters."""
        listed = named_parameters(self.term, self.constants[variant], count, self.summary)
        return [(f"{each.name}{self.term.joint + 1}", each.unit) for each in listed]

    def reported_offset(self, variant: int) -> float:
        """What is added to the fitted values when they are reported."""
        return self.term.effect.reported_offset(self.constants[variant])

    def outside(self, estimates: Array, variant: int) -> NDArray[np.bool_]:
        """(parameters,) which estimates the effect cannot have; all where they cannot be had together.

        Nothing is known of estimates of some of its columns only.
        """
        count = len(estimates)
        if count != len(self.term.effect.parameters_of(self.summary, self.constants[variant])):
            return np.zeros(count, bool)
        bounds = self.bounds(count, variant)
        beyond = (estimates < bounds.lower) | (estimates > bounds.upper)
        together = bool(np.all(bounds.matrix @ estimates >= bounds.least))
        return beyond if together or beyond.any() else np.ones(count, bool)

    def columns(self, observation: Observation, variant: int) -> Index:
        """Columns of one choice."""
        return observation.slot_columns[self.first + variant]

    def complexity(self, observation: Observation, variant: int) -> int:
        """Number of parameters and searched constants."""
        searched = len(self.constants[variant]) if len(self.constants) > 1 else 0
        return len(self.columns(observation, variant)) + searched


def find_candidates(
    record: Record,
    model: Model,
    known: Mapping[str, Effect],
    summaries: Sequence[JointSummary],
    first: int,
) -> tuple[list[Candidate], list[NotApplicable]]:
    """Candidates for every joint, and what was left out with the reason in words.

    first : index of the first candidate's slot in the observation to come
    """
    candidates: list[Candidate] = []
    left_out: list[NotApplicable] = []
    for summary in summaries:
        for effect in known.values():
            if model.has(effect.name, summary.joint):
                continue
            reason = effect.prevented(summary)
            if reason:
                left_out.append(NotApplicable(effect=effect.name, joint=summary.name, reason=reason))
                continue
            for term in terms_of(effect, [summary.joint], record.experiment.drive_gain):
                if term.key in {present.key for present in model.terms} or summary.joint not in rows_of(
                    record, term
                ):
                    continue
                constants = tuple(effect.grid(summary))
                candidates.append(
                    Candidate(
                        term, summary.joint, constants, first, effect.searched(summary), summaries[term.joint]
                    )
                )
                first += len(constants)
    return candidates, left_out
