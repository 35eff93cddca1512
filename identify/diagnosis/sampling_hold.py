"""What sampling itself makes of a fitted effect: no fault of the machine, and nothing that an operator can mend."""

from statistics import NormalDist

import numpy as np

from identify.diagnosis.deciding_constants import SIGNIFICANCE
from identify.effects.model import Term
from identify.estimation.fitted_model import FittedModel


def made_by_recording(fitted: FittedModel, term: Term) -> str | None:
    """Words where a term of a fitted model cannot be told from what recording makes by itself; else None.

    What is named must differ from that as surely as from nothing (`SIGNIFICANCE`, to both sides).
    """
    period = min(fitted.record.facts(entry).period for entry in fitted.entries)
    classical, robust = fitted.deviations
    margins = NormalDist().inv_cdf(1 - SIGNIFICANCE / 2) * np.where(np.isnan(robust), classical, robust)
    for slot, columns in zip(fitted.slots, fitted.observation.slot_columns, strict=True):
        if slot.term.key == term.key and (
            reason := term.effect.made_by_recording(fitted.fit.chi[columns], margins[columns], period)
        ):
            return reason
    return None
