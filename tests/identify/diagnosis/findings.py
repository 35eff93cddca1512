"""Findings with chosen figures, without a fit: what is judged of them is arithmetic."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from identify.diagnosis.closed_loop import LoopEvidence
from identify.diagnosis.finding import Finding
from identify.diagnosis.held_out import HeldOut


@dataclass(frozen=True)
class NamedCandidate:
    """What is asked of a candidate once it has been fitted."""

    name: str
    from_derivatives: bool = False


def held_out(*folds: float, power: tuple[float, ...] | None = None) -> HeldOut:
    """Squared errors by fold; the effect acts in all of them alike where `power` is not given."""
    return HeldOut(sum(folds), np.array(folds, float), np.array(power or [1.0] * len(folds)), 0)


def instruments(p_value: float, part: float = 1.0) -> LoopEvidence:
    """What instruments say of an effect."""
    return LoopEvidence(np.zeros(1), p_value, part)


def finding(before: HeldOut, after: HeldOut, name: str = "effect", **figures: object) -> Finding:
    """A finding that is justified as far as its errors go."""
    given: dict = {
        "comparable_gain": before.total - after.total,
        "measured": 100.0,
        "p_value": 1e-4,
        "complexity": 1,
        "sessions_agree": True,
    }
    from_derivatives = bool(figures.pop("from_derivatives", False))
    return Finding(NamedCandidate(name, from_derivatives), 0, before, after, **(given | figures))  # type: ignore[arg-type]
