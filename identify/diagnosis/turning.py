"""What a record does not know of the instants at which a joint turns round, as a rival to every effect.

Each instant has a deviation of its own (`signals.reversals`), by which the samples around it are weighted. But a part of its
error is alike at all reversals: a stop that the encoder does not show, the same preference for a smooth course. Dry friction
that steps later than it is thought to leaves a pulse at every reversal, as do a short delay and a short presliding.
"""

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from identify.diagnosis.evidence import group_evidence
from identify.effects.dry_friction import Coulomb
from identify.effects.effect import Constants, Effect
from identify.effects.model import Term
from identify.effects.motion import Array, JointMotion
from identify.effects.parameter import EffectParameter
from identify.estimation import forked
from identify.estimation.fitted_model import FittedModel
from identify.estimation.observation import Observation, Slot
from identify.estimation.statistics import NORMAL

Index = NDArray[np.intp]


class LateTurn(Effect):
    """Dry friction F_C that turns by ε/F_C later at all reversals, in first order."""

    name = "late turn"
    group = "free"
    equation = "−ε d sign(q̇)/dt"
    explanation = "What the record does not know of the instants of reversal; it names no cause."
    regressors = ("−d sign(q̇)/dt",)
    parameters = (EffectParameter("late", "N m s"),)
    source = "first order in the time"

    def columns(self, motion: JointMotion, constants: Constants) -> Array:
        return -np.gradient(motion.direction, motion.period)[:, None]


def late_turns(joints: int) -> list[Slot]:
    """The column of each joint."""
    return [Slot.of(Term(LateTurn(), joint), {}) for joint in range(joints)]


def possible_turns(
    fitted: FittedModel, observation: Observation, base: Index, columns: Sequence[Index]
) -> list[Index]:
    """Of every joint the column of its late turns, where what the instants are known to leaves room for it; else none.

    observation : beside the model's columns it has those of `late_turns`
    base        : columns of the model

    The room is the 95 % interval of an instant. What would have to be later than that is an effect and no error.
    """

    def is_possible(joint: int) -> bool:
        room = NORMAL * deviation_of_instants(fitted, joint) * _dry_friction(fitted, joint)
        if room <= 0.0:
            return False
        later = group_evidence(observation, joint, base, columns[joint]).estimates
        return len(later) > 0 and abs(float(later[0])) <= room

    possible = forked.each(is_possible, range(len(columns)))
    return [turning if holds else turning[:0] for turning, holds in zip(columns, possible, strict=True)]


def deviation_of_instants(fitted: FittedModel, joint: int) -> float:
    """s, root mean square over the reversals of a joint in the sessions of the fit; 0 where there are none."""
    turns = np.concatenate([fitted.record.samples[entry.file].turns for entry in fitted.entries])
    deviation = turns[turns[:, 0] == joint, 1]
    return float(np.sqrt(np.mean(deviation**2))) if len(deviation) else 0.0


def _dry_friction(fitted: FittedModel, joint: int) -> float:
    """N m or N, of the fitted model; 0 where it has none."""
    for slot, columns in zip(fitted.slots, fitted.observation.slot_columns, strict=True):
        if slot.term.joint == joint and slot.term.effect.name == Coulomb.name:
            return float(fitted.fit.chi[columns[0]])
    return 0.0
