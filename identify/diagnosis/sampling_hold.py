"""A delay that sampling itself makes: no fault of the machine, and nothing that an operator can mend.

A controller holds its command over a period. Recorded at the period's start the command is early by half of one, at its
end late by as much; the position is that of one instant.
"""

from identify.effects.model import Term
from identify.estimation.fitting import FittedModel

HALF, WITHIN = 0.5, 0.15
"""Periods of sampling that a held command makes, and what a fit can be wrong by."""

HOLD_WORDS = (
    "It is half a period of sampling, as a command makes that is held over its period: recorded at the start it is "
    "early by so much, at the end late. By itself it is no fault of the machine."
)


def is_sampling_hold(fitted: FittedModel, term: Term) -> bool:
    """Whether a term of a fitted model is a delay as long as the hold of the command makes."""
    if term.effect.name != "delay":
        return False
    period = min(fitted.record.facts(entry).period for entry in fitted.entries)
    return any(
        slot.term.key == term.key and abs(abs(float(values[0])) / period - HALF) <= WITHIN
        for slot, values in fitted.torque.factors
    )
