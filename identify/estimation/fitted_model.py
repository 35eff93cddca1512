"""A model fitted to the identification sessions of a record: what a fit gives, and what is read from it."""

from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from identify.effects.model import Model
from identify.estimation.elimination import Elimination
from identify.estimation.estimate import Estimate
from identify.estimation.least_squares import LeastSquares, residual_norms
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
    load_from : what the columns follow that depend on the load or the torque: the model's own (`with_own_load`), except
        where it has no arm of its own, as eq. (30) in its linear form
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

    def with_own_load(self) -> "FittedModel":
        """The same parameters with columns that follow the load and the torque of these parameters, no other fit's.

        A fit takes the columns that follow the load from the fit before it; with the load of its own the model's torque is one
        function of the motion, the power sign of eq. (26) included, whoever computes it. Its errors are those of that function.
        """
        torque = self.torque
        has_arm = bool(np.any(self.fit.fitted < self.observation.base))
        if not has_arm or not any(slot.follows_fit for slot in self.slots) or torque.same_as(self.load_from):
            return self
        observation = observe(self.record, self.entries, self.slots, torque)
        fit = replace(self.fit, residual=residual_norms(observation, self.fit.chi))
        estimate = None if self.estimate is None else replace(self.estimate, fit=fit)
        return replace(self, observation=observation, fit=fit, load_from=torque, estimate=estimate)
