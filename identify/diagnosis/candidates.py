"""The candidates: every effect of the catalogue that a joint's model does not have and the record could show."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from identify.diagnosis.held_out import Trial
from identify.effects.effect import Effect
from identify.effects.model import Model, Term, terms_of
from identify.effects.motion import JointSummary
from identify.estimation.observation import Observation, Slot, rows_of
from identify.estimation.record import Record
from identify.results.diagnosis import NotApplicable

Index = NDArray[np.intp]

DECLARED_LOAD = ("payload-mass", "drive-gain", "payload-com", "gravity-tilt")
"""Effects that say that a declared load is wrong. They are judged against loads taken as declared; all others against
a model that estimates the payload ratio beside (eq. 35), which would hide what these are about."""

LOAD_FRICTION = ("load-friction", "load-friction-asymmetric")
"""Effects fitted with loads as declared: an asymmetric efficiency and a payload ratio are the same column of the load,
so that one of them must be taken as known. Their gain still counts from the model with the ratio, if that is better."""


LOADS_AS_DECLARED = (*DECLARED_LOAD, *LOAD_FRICTION)
"""Effects beside which no payload ratio is estimated."""


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

    @property
    def name(self) -> str:
        """Name of the effect."""
        return self.term.effect.name

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
        return Trial(tuple(observation.slot_columns[index] for index in indices))

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
    known: dict[str, Effect],
    summaries: Sequence[JointSummary],
    first: int,
) -> tuple[list[Candidate], list[NotApplicable]]:
    """Candidates for every joint, and what was left out with the reason in words.

    first : index of the first candidate's slot in the observation to come
    """
    found: list[Candidate] = []
    left_out: list[NotApplicable] = []
    for summary in summaries:
        for effect in known.values():
            if model.has(effect.name, summary.joint):
                continue
            obstacle = effect.obstacle(summary)
            if obstacle:
                left_out.append(NotApplicable(effect=effect.name, joint=summary.name, reason=obstacle))
                continue
            for term in terms_of(effect, [summary.joint], record.experiment.drive_gain):
                if term.key in {own.key for own in model.terms} or summary.joint not in rows_of(record, term):
                    continue
                constants = tuple(effect.grid(summary))
                found.append(Candidate(term, summary.joint, constants, first, effect.searched(summary)))
                first += len(constants)
    return found, left_out
