"""What sampling itself makes of a fitted effect: no fault of the machine, and nothing that an operator can mend."""

from identify.effects.model import Term
from identify.estimation.fitted_model import FittedModel


def made_by_recording(fitted: FittedModel, term: Term) -> str | None:
    """Words where a term of a fitted model has the size that recording makes by itself; else None."""
    period = min(fitted.record.facts(entry).period for entry in fitted.entries)
    for slot, values in fitted.torque.factors:
        if slot.term.key == term.key and (reason := term.effect.made_by_recording(values, period)):
            return reason
    return None
