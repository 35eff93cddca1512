"""A model fitted to the identification sessions of a record: what a fit gives, and what is read from it."""

from collections.abc import Sequence
from dataclasses import dataclass, field
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from identify.effects.model import Model
from identify.estimation.elimination import Elimination
from identify.estimation.estimate import Estimate
from identify.estimation.least_squares import LeastSquares
from identify.estimation.observation import FittedTorque, Observation, Slot, observe
from identify.estimation.record import Record
from identify.estimation.statistics import classical_deviation, robust_deviation
from identify.recording import SessionEntry

Array = NDArray[np.float64]


@dataclass(frozen=True)
class FittedModel:
    """A model fitted to the identification sessions of a record.

    model : its terms with their constants chosen
    slots : the terms' columns, and behind them those of the payload ratio where it is estimated beside the
    model
    """

    record: Record
    model: Model
    slots: tuple[Slot, ...]
    entries: tuple[SessionEntry, ...]
    observation: Observation
    fit: LeastSquares
    load_from: FittedTorque | None
    estimates_payload_ratio: bool
    estimator: str = "weighted"
    estimate: Estimate | None = None
    """what an estimator other than least squares found; `fit` then holds its parameters"""
    eliminated: tuple[Elimination, ...] = ()
    """parameters that the data do not show, taken out one by one"""
    held: dict[str, object] = field(default_factory=dict, init=False, repr=False, compare=False)
    """what was computed of this model, and is asked for again"""

    @cached_property
    def deviations(self) -> tuple[Array, Array]:
        """(width,) each: deviations of eq. (13)-(15), and those that hold for coloured residuals."""
        if self.estimate is not None:
            return self.estimate.std, self.estimate.std_robust
        return classical_deviation(self.fit), robust_deviation(self.observation, self.fit)

    @property
    def torque(self) -> FittedTorque:
        """The fitted model as other effects' columns need it."""
        values = [
            (slot, self.fit.chi[columns])
            for slot, columns in zip(self.slots, self.observation.slot_columns, strict=True)
        ]
        return FittedTorque(self.fit.chi[: self.observation.base], tuple(values))

    def observe(self, entries: Sequence[SessionEntry]) -> Observation:
        """The same columns on other sessions."""
        return observe(self.record, entries, self.slots, self.load_from)
