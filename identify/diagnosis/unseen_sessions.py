"""Whether a model that suits the sessions of its fit fails on those that it did not see."""

from collections.abc import Sequence
from typing import cast

import numpy as np
from numpy.typing import NDArray

from identify.diagnosis.deciding_constants import WORSE
from identify.effects.model import Term
from identify.estimation import forked
from identify.estimation.block_errors import block_errors
from identify.estimation.constrained import admissible_columns, admissible_fit
from identify.estimation.fitted_model import FittedModel
from identify.estimation.least_squares import least_squares
from identify.estimation.observation import Observation
from identify.estimation.prediction import Prediction, mean_error

Array = NDArray[np.float64]


def fails_on_unseen(known: Sequence[Prediction], unseen: Sequence[Prediction]) -> bool:
    """Whether a joint's error on unseen sessions is beyond that on known ones."""
    if not unseen:
        return False
    here, there = _residual(known), _residual(unseen)
    if not len(here) or not len(there):
        return False
    absolute = float(np.sqrt(np.mean(there**2) / max(np.mean(here**2), 1e-300)))
    relative = mean_error(unseen) / max(mean_error(known), 1e-300)
    return min(absolute, relative) > WORSE


def _residual(parts: Sequence[Prediction]) -> Array:
    """Of the samples in motion."""
    return np.concatenate([part.residual[part.moving] for part in parts])


def errors_on_unseen(fitted: FittedModel) -> Array | None:
    """(joints,) squared errors of a model on the validation sessions, computed once; None where there are none."""
    unseen = _unseen(fitted)
    return None if unseen is None else unseen[1]


def lowers_on_unseen(fitted: FittedModel, other: FittedModel, joint: int) -> bool:
    """Whether a model has a lower error on the validation sessions than another: of a joint, or of all together."""
    errors, others = errors_on_unseen(fitted), errors_on_unseen(other)
    return errors is not None and others is not None and _lower(errors, others, joint)


def worse_on_unseen(fitted: FittedModel, added: Sequence[tuple[Term, int]]) -> list[tuple[Term, int]]:
    """Terms of a model, each with the joint it is judged on, that raise that joint's error on the validation sessions, or
    that of all joints together; those first without which the error of all is least.

    Each is compared with the model without it, all constants as they are.
    """
    known = _unseen(fitted) if added else None
    if known is None:
        return []
    unseen, present = known
    bounds = admissible_columns(fitted.observation, fitted.record.summaries)

    def left_without(row: tuple[Term, int]) -> Array | None:
        (term, _) = row
        for slot, columns in zip(fitted.slots, fitted.observation.slot_columns, strict=True):
            if slot.term.key == term.key:
                rest = np.setdiff1d(fitted.fit.fitted, columns)
                other = least_squares(fitted.observation, rest, weights=fitted.fit.weights)
                other = admissible_fit(fitted.observation, other, bounds)
                return block_errors(unseen, other.chi).sum(axis=0)[:, 0]
        return None

    worse = [
        (float(left.sum()), row)
        for row, left in zip(added, forked.each(left_without, added), strict=True)
        if left is not None and _lower(left, present, row[1])
    ]
    return [row for _, row in sorted(worse, key=lambda each: each[0])]


def _lower(errors: Array, others: Array, joint: int) -> bool:
    return bool(errors[joint] < others[joint] or errors.sum() < others.sum())


def _unseen(fitted: FittedModel) -> tuple[Observation, Array] | None:
    """The validation sessions, and the squared errors there of every joint."""
    entries = fitted.record.entries("validation")
    if not entries:
        return None
    held = fitted.held.get("validation sessions")
    if held is None:
        unseen = fitted.observe(entries)
        held = unseen, block_errors(unseen, fitted.fit.chi).sum(axis=0)[:, 0]
        fitted.held["validation sessions"] = held
    return cast("tuple[Observation, Array]", held)
